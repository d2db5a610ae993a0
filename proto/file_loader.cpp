#include "proto/file_loader.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tessera::proto {
namespace {

constexpr std::size_t kLongestPath = 4096;
constexpr const char* kChanged = "The file changed while it was read; send the scene again.";

std::string folder_of(std::string_view path) { return std::filesystem::path(path).parent_path().generic_string(); }

/// The same file under the same key makes the same shapes. MTL libraries stand beside a path, or come with a blob.
std::string cache_key(const FileReference& reference) {
  std::string key = reference.file.hash + '\n' + std::to_string(static_cast<int>(reference.format)) + '\n';
  const ImportOptions& options = reference.options;
  if (options.smooth) key += "smooth " + std::to_string(std::bit_cast<std::uint32_t>(*options.smooth)) + '\n';
  if (options.scene) key += "scene " + std::to_string(*options.scene) + '\n';
  if (options.variant) key += "variant " + std::to_string(options.variant->size()) + ':' + *options.variant;
  if (!reference.companions) return key + "in " + folder_of(reference.name);
  for (const auto& [name, file] : *reference.companions) {
    key += std::to_string(name.size()) + ':' + name + file.hash;
  }
  return key;
}

std::optional<SourceFile> found(const Result<SourceFile>& file, const JsonCursor& where) {
  if (file) return *file;
  where.error(file.problem().detail);
  return std::nullopt;
}

std::optional<SourceFile> find_asset(const std::string& path, const JsonCursor& where, const FileSource& files,
                                     const std::stop_token& stop) {
  if (path.empty()) {
    where.expected("a path below the asset root");
    return std::nullopt;
  }
  const auto file = files.asset(path, stop);
  throw_if_abandoned(stop);
  return found(file, where);
}

std::optional<SourceFile> find_blob(const JsonCursor& value, const FileSource& files, const std::stop_token& stop) {
  if (value.kind() != JsonKind::string || !is_content_hash(value.string())) {
    value.expected("a content hash: \"sha256:\" and 64 hexadecimal digits in lower case");
    return std::nullopt;
  }
  const auto file = files.blob(ContentHash(value.string()), stop);
  throw_if_abandoned(stop);
  return found(file, value);
}

bool find_companions(const JsonCursor& value, const FileSource& files, const std::stop_token& stop,
                     std::map<std::string, SourceFile>& out) {
  if (value.kind() != JsonKind::object) return value.expected("an object of file names and their content hashes");
  bool good = true;
  value.each_member([&](std::string_view name, const JsonCursor& hash) {
    const auto file = find_blob(hash, files, stop);
    good &= file.has_value();
    if (file) out.emplace(name, *file);
  });
  return good;
}

/// The file that one of `path` and `blob` names, which is the one that is there, and how messages call it.
struct FoundFile {
  std::string name;
  SourceFile file;
};
std::optional<FoundFile> find_file(const std::optional<JsonCursor>& path, const std::optional<JsonCursor>& blob,
                                   const FileSource& files, const std::stop_token& stop) {
  FoundFile found;
  std::optional<SourceFile> file;
  if (path) {
    if (read(path, found.name, kLongestPath)) file = find_asset(found.name, *path, files, stop);
  } else {
    file = find_blob(*blob, files, stop);
    if (file) found.name = file->hash;
  }
  if (!file) return std::nullopt;
  found.file = *file;
  return found;
}

bool read_options(JsonFields& fields, ImportOptions& options) {
  constexpr NumberRange kBend{0, 180, false, "an angle in degrees from 0 to 180"};
  const auto smooth = fields.optional("smooth"), variant = fields.optional("variant"), scene = fields.optional("scene");
  bool good = true;
  if (smooth) good &= read(smooth, options.smooth.emplace(), kBend);
  if (variant) good &= read(variant, options.variant.emplace(), kLongestPath);
  if (scene) good &= read(scene, options.scene.emplace(), 0, 0xFFFFFFFF);
  return good;
}

/// The companions of a file, by the names that it may give them.
class Companions {
 public:
  using Files = std::map<std::string, SourceFile>;

  explicit Companions(const Files& files) : files_(files) {}

  /// The file of that name or, as forms are often sent without folders, of the name without them; else, as Windows
  /// tells no cases apart, the one whose name is the same but for case and backslashes, unless there are several.
  Files::const_iterator find(const std::string& name) {
    const std::string file_name = std::filesystem::path(name).filename().generic_string();
    for (const std::string& each : {name, file_name})
      if (const auto found = files_.find(each); found != files_.end()) return found;
    if (folded_.empty())
      for (auto file = files_.begin(); file != files_.end(); ++file) folded_[folded(file->first)].push_back(file);
    const std::string anyhow = folded(name);
    for (const std::string& each : {anyhow, std::filesystem::path(anyhow).filename().generic_string()}) {
      const auto found = folded_.find(each);
      if (found == folded_.end() || found->second.size() > 1) continue;
      found_anyhow_.emplace(name, found->second.front()->first);
      return found->second.front();
    }
    return files_.end();
  }

  /// What is to be told of those that were found by other names than their own; empty where none was.
  std::string note() const {
    constexpr std::size_t kMostNames = 5;
    std::string text;
    std::size_t count = 0;
    for (const auto& [name, file] : found_anyhow_)
      if (++count <= kMostNames) text += (count == 1 ? "" : ", ") + in_quotes(name) + " is " + in_quotes(file);
    if (text.empty()) return text;
    return "Companions are found whose names aren't written as the file writes them: " + text +
           (count > kMostNames ? ", and others." : ".");
  }

 private:
  static std::string folded(std::string name) {
    for (char& c : name) c = c == '\\' ? '/' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return std::filesystem::path(name).lexically_normal().generic_string();
  }

  const Files& files_;
  std::map<std::string, std::vector<Files::const_iterator>> folded_;
  std::map<std::string, std::string> found_anyhow_;
};

/// What isn't the document's fault.
void throw_if_ours(const Problem& problem) {
  if (problem.code == ProblemCode::out_of_memory_budget) throw std::bad_alloc();
  if (problem.code == ProblemCode::internal_error) throw std::runtime_error(problem.detail);
  if (problem.code != ProblemCode::invalid_document) throw NoFaultOfTheDocument{problem};
}

/// Whether a file is still what was found. A file that can't be read any more isn't.
bool is_unchanged(const SourceFile& file, const std::stop_token& stop) {
  const auto hash = hash_file(file.path, stop);
  throw_if_abandoned(stop);
  return hash == file.hash;
}

}  // namespace

std::optional<FileReference> FileLoader::find(JsonFields& fields) const {
  fields.call("a file");
  const auto path = fields.optional("path"), blob = fields.optional("blob"), format_field = fields.optional("format"),
             companions = fields.optional("companions");
  if (path.has_value() == blob.has_value()) {
    fields.value().error("A file needs either \"path\" or \"blob\", and not both.");
    return std::nullopt;
  }
  FileReference reference{fields.value(), {}, {}, {}, {}, {}};
  bool good = read(format_field, reference.format, file_format_names());
  good &= read_options(fields, reference.options);
  const auto file = find_file(path, blob, files_, stop_);
  if (path) {
    if (companions) good = companions->error("\"companions\" go with a blob; a path finds its own beside it.");
  } else {
    reference.companions.emplace();
    if (companions) good &= find_companions(*companions, files_, stop_, *reference.companions);
  }
  if (!file || !good) return std::nullopt;
  reference.name = file->name;
  reference.file = file->file;
  if (!format_field) {
    const auto format = path ? format_of(reference.name) : std::nullopt;
    if (!format) {
      fields.value().error(std::string("The format can't be told ") + (path ? "by the path's ending" : "of a blob") +
                           "; add \"format\": \"obj\", \"ply\", \"stl\", \"nff\" or \"gltf\".");
      return std::nullopt;
    }
    reference.format = *format;
  }
  return reference;
}

const LoadedFile* FileLoader::load(const FileReference& reference) {
  const auto [entry, is_new] = loaded_.try_emplace(cache_key(reference));
  if (is_new) entry->second = import(reference);
  if (!entry->second) return nullptr;
  identities_[reference.where.index()] = &entry->second->identity;
  return &*entry->second;
}

bool FileLoader::find_environment(JsonFields& fields, std::shared_ptr<const EnvironmentMap>& map) {
  const auto path = fields.optional("path"), blob = fields.optional("blob");
  if (!path && !blob) return false;
  if (path && blob) {
    fields.value().error("An environment's map comes from \"path\" or from \"blob\", and not from both.");
    return true;
  }
  const JsonCursor& where = path ? *path : *blob;
  const auto found = find_file(path, blob, files_, stop_);
  if (!found) return true;
  const auto imported = files_.reader().environment(found->file.path, found->name, builder_.bytes_left(), stop_);
  if (path && !is_unchanged(found->file, stop_)) {
    where.error(kChanged);
  } else if (!imported) {
    throw_if_ours(imported.problem());
    where.error(imported.problem().detail);
  } else if (builder_.take((*imported)->texels.size() * sizeof(Rgb), where)) {
    map = *imported;
    if (path) assets_.emplace(found->file.hash, found->file.path);
    identities_[fields.value().index()] = &environments_.emplace_back(FileIdentity{found->file.hash, {}, {}});
  }
  return true;
}

std::vector<SourceFile> FileLoader::assets() const {
  std::vector<SourceFile> files;
  for (const auto& [hash, path] : assets_) files.push_back({path, hash});
  return files;
}

std::optional<LoadedFile> FileLoader::import(const FileReference& reference) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(reference.file.path, error);
  if (!error && size > builder_.bytes_left()) {
    reference.where.error("The file of " + std::to_string(size) + " bytes is larger than what a scene may still take.");
    return std::nullopt;
  }

  LoadedFile loaded;
  loaded.identity = {reference.file.hash, reference.format, {}};
  std::vector<SourceFile> assets;  // That are read; blobs never change.
  if (!reference.companions) assets.push_back(reference.file);
  std::optional<Companions> companions;
  if (reference.companions) companions.emplace(*reference.companions);
  const auto companion = [&](std::string_view name) -> std::optional<InputFile> {
    if (companions) {
      const auto given = companions->find(std::string(name));
      if (given == reference.companions->end()) return std::nullopt;
      loaded.identity.companions.emplace(given->first, given->second.hash);
      return given->second.path;
    }
    const std::filesystem::path path = std::filesystem::path(folder_of(reference.name)) / name;
    const auto sibling = files_.asset(path.lexically_normal().generic_string(), stop_);
    if (!sibling) return std::nullopt;
    assets.push_back(*sibling);
    loaded.identity.companions.emplace(name, sibling->hash);
    return sibling->path;
  };
  Result<Imported> imported = files_.reader().import(reference.file.path, reference.format, reference.name, companion,
                                                     stop_, reference.options, builder_.bytes_left());
  if (!std::ranges::all_of(assets, [&](const SourceFile& file) { return is_unchanged(file, stop_); })) {
    reference.where.error(kChanged);
    return std::nullopt;
  }
  for (const SourceFile& file : assets) assets_.emplace(file.hash, file.path);
  if (!imported) {
    const Problem& problem = imported.problem();
    throw_if_ours(problem);
    if (problem.errors.empty()) reference.where.error(problem.detail);
    for (const FieldError& e : problem.errors) {
      const bool is_option = e.pointer == "variant" || e.pointer == "scene";
      reference.where.errors().add(is_option ? reference.where.pointer() + '/' + e.pointer : e.pointer, e.detail);
    }
    return std::nullopt;
  }

  const auto first_texture = builder_.add_textures(imported->textures, reference.where);
  if (!first_texture) return std::nullopt;
  std::vector<std::uint32_t> materials;
  for (Material& material : imported->materials) {
    for (TextureUse& use : material.textures) use.texture += *first_texture;
    materials.push_back(builder_.add_material(material));
  }
  const auto material_of = [&](const std::optional<std::uint32_t>& material) -> std::optional<std::uint32_t> {
    if (!material) return std::nullopt;
    return materials.at(*material);
  };
  for (ImportedPart& part : imported->parts) {
    const auto shape = builder_.add_shape(std::move(part.shape), reference.where);
    if (!shape) return std::nullopt;
    loaded.parts.push_back({*shape, material_of(part.material)});
  }
  if (!imported->placements.empty()) {
    const std::vector<ScenePart> parts = std::move(loaded.parts);
    loaded.parts.clear();
    for (const ImportedPlacement& placed : imported->placements) {
      ScenePart& part = loaded.parts.emplace_back(parts.at(placed.part));
      part.placement = placed.placement;
      if (placed.material) part.material = material_of(placed.material);
    }
  }
  for (SceneWarning& warning : imported->warnings) builder_.warn(std::move(warning));
  if (loaded.parts.empty()) builder_.warn(reference.where, "The file holds no shapes, so nothing of it is seen.");
  if (companions) {
    if (const std::string note = companions->note(); !note.empty()) builder_.warn(reference.where, note);
    for (const auto& [name, file] : *reference.companions) {
      if (!loaded.identity.companions.contains(name)) {
        builder_.warn(reference.where, "The file doesn't ask for its companion " + in_quotes(name) + ".");
      }
    }
  }
  loaded.lights = std::move(imported->lights);
  loaded.background = imported->background;
  loaded.cameras = std::move(imported->cameras);
  loaded.image = imported->image;
  return loaded;
}

}  // namespace tessera::proto
