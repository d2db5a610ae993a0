#include "proto/import/gltf/textures.h"

#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "core/io/read_texture.h"
#include "core/math/portable.h"
#include "proto/wire/file_kind.h"
#include "proto/wire/uri.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kNearest = 9728, kLinear = 9729, kRepeat = 10497, kClamp = 33071, kMirror = 33648;

/// Whether an image of that media type, empty where none is given, is a file of another kind.
bool lies(std::string_view media_type, FileKind kind) {
  if (media_type == "image/png") return kind != FileKind::png;
  if (media_type == "image/jpeg") return kind != FileKind::jpeg;
  if (media_type == "image/webp") return kind != FileKind::webp;
  return !media_type.empty();
}

}  // namespace

GltfTextures::GltfTextures(GltfFile& file, GltfBuffers& buffers, std::uint64_t most_bytes)
    : file_(file), buffers_(buffers), most_bytes_(most_bytes) {
  const GltfObject root = file.root();
  for (const JsonCursor& sampler : root.array("samplers")) samplers_.push_back(read_sampler(GltfObject(sampler)));
  for (const JsonCursor& image : root.array("images")) images_.push_back(read_image(GltfObject(image)));
  for (const JsonCursor& texture : root.array("textures")) textures_.push_back(read_texture(GltfObject(texture)));
}

GltfTextures::Sampler GltfTextures::read_sampler(const GltfObject& object) {
  Sampler sampler;
  const auto wrap = [&](std::string_view name, Wrap& out) {
    std::uint32_t mode = kRepeat;
    const auto field = object.find(name);
    if (!read(field, mode, 0, UINT32_MAX)) return;
    if (mode == kClamp) out = Wrap::clamp;
    if (mode == kMirror) out = Wrap::mirror;
    if (mode != kClamp && mode != kMirror && mode != kRepeat)
      file_.note(*field, "A wrap mode that glTF doesn't know counts as repetition");
  };
  wrap("wrapS", sampler.wrap_u);
  wrap("wrapT", sampler.wrap_v);
  std::uint32_t filter = kLinear, reduction = kLinear;
  if (read(object.find("magFilter"), filter, 0, UINT32_MAX)) sampler.is_nearest = filter == kNearest;
  read(object.find("minFilter"), reduction, 0, UINT32_MAX);
  return sampler;
}

GltfTextures::Image GltfTextures::read_image(const GltfObject& object) {
  Image image{.where = object.value(), .uri = object.find("uri")};
  const auto view = object.find("bufferView"), type = object.find("mimeType");
  image.view = read_reference(view, buffers_.views(), "buffer view");
  if (image.view && !buffers_.use(*image.view, ViewUse::other, *view)) image.view.reset();
  if (type && type->kind() != JsonKind::string) type->expected("a media type");
  if (type && type->kind() == JsonKind::string) image.media_type = type->string();
  if (image.uri && image.uri->kind() != JsonKind::string) {
    image.uri->expected("a URI");
    image.uri.reset();
  }
  if (object.find("uri") && view) object.value().error("An image comes from a URI or a buffer view, not from both.");
  if (view && !type) object.value().error("An image in a buffer view needs a \"mimeType\".");
  return image;
}

GltfTextures::Source GltfTextures::read_texture(const GltfObject& object) {
  Source texture{object.value(), read_reference(object.find("source"), images_.size(), "image"), {}};
  if (const auto webp = object.extension("EXT_texture_webp")) {
    if (const auto image = read_reference(webp->find("source"), images_.size(), "image")) texture.image = image;
  }
  if (const auto sampler = read_reference(object.find("sampler"), samplers_.size(), "sampler"))
    texture.sampler = samplers_[*sampler];
  return texture;
}

std::optional<TextureInfo> GltfTextures::read_info(const std::optional<GltfObject>& object) {
  if (!object) return std::nullopt;
  const auto texture = read_reference(object->required("index"), textures_.size(), "texture");
  std::uint32_t set = 0;
  TextureInfo info;
  if (!read(object->find("texCoord"), set, 0, UINT32_MAX)) return std::nullopt;
  read_transform(*object, info, set);
  if (!texture) return std::nullopt;
  if (set > 1) {
    file_.note(object->value(), "A texture that uses texture coordinates beyond two sets is left out");
    return std::nullopt;
  }
  info.texture = *texture;
  info.uv_set = static_cast<std::uint8_t>(set);
  return info;
}

/// KHR_texture_transform: scaled, then rotated, then moved. Its "rotation" turns coordinates counter-clockwise as seen
/// with v growing downwards: in its own example, (0, 1) at the left of the image's lower half.
void GltfTextures::read_transform(const GltfObject& object, TextureInfo& info, std::uint32_t& set) {
  const auto transform = object.extension("KHR_texture_transform");
  if (!transform) return;
  std::array<double, 2> offset{}, scale{1, 1};
  double angle = 0;
  const bool good = read_numbers(transform->find("offset"), offset) && read_numbers(transform->find("scale"), scale) &&
                    read(transform->find("rotation"), angle) && read(transform->find("texCoord"), set, 0, UINT32_MAX);
  if (!good) return;
  angle = std::remainder(angle, 2 * std::numbers::pi);
  const double c = portable_cos(angle), s = portable_sin(angle);
  const std::array<double, 6> rows{c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  for (std::size_t i = 0; i < rows.size(); ++i) info.transform[i] = static_cast<float>(rows[i]);
}

std::optional<std::uint32_t> GltfTextures::use(const TextureInfo& info, bool is_srgb) {
  const auto [known, is_new] = used_.try_emplace({info, is_srgb}, static_cast<std::uint32_t>(out_.size()));
  if (!is_new) return known->second < out_.size() ? std::optional(known->second) : std::nullopt;
  const Source& source = textures_[info.texture];
  std::shared_ptr<const TextureImage> image;
  if (source.image) {
    image = open(images_[*source.image]);
  } else {
    file_.note(source.where, "A texture without an image that can be read is left out");
  }
  if (!image) {
    known->second = UINT32_MAX;
    return std::nullopt;
  }
  out_.push_back({image, source.sampler.wrap_u, source.sampler.wrap_v, source.sampler.is_nearest, is_srgb, info.uv_set,
                  info.transform, file_.place("/images/" + std::to_string(*source.image))});
  return known->second;
}

std::shared_ptr<const TextureImage> GltfTextures::open(Image& image) {
  if (image.is_opened) return image.opened;
  image.is_opened = true;
  Content content = content_of(image);
  if (!content.image) {
    while (content.problem.ends_with('.')) content.problem.pop_back();
    file_.note(image.where, "An image can't be used, and its textures are left out: " + content.problem);
  } else if (lies(image.media_type, content.kind)) {
    file_.note(image.where, "An image that is told to be " + in_quotes(image.media_type) + " is " +
                                std::string(description(content.kind)));
  }
  return image.opened = content.image;
}

GltfTextures::Content GltfTextures::content_of(const Image& image) {
  if (image.view) {
    const auto bytes = buffers_.bytes(*image.view, image.where);
    if (!bytes) return {};  // which is an error
    const auto [known, is_new] = in_buffers_.try_emplace({bytes->data(), bytes->size()});
    if (is_new && file_.take(bytes->size(), image.where)) known->second = read_content(*bytes);
    return known->second;
  }
  if (!image.uri) return unusable("It has neither a URI nor a buffer view");
  if (is_data_uri(image.uri->string())) {
    const auto data = read_data_uri(image.uri->string());
    if (const auto* fault = std::get_if<std::string>(&data)) return unusable("Its data: URI can't be read: " + *fault);
    return read_content(std::get<DataUri>(data).bytes);
  }
  std::string why;
  const auto companion = file_.find_companion(image.uri->string(), why);
  if (!companion) return unusable(std::move(why));
  const auto [known, is_new] = in_files_.try_emplace(companion->file.path);
  if (is_new) {
    const auto bytes = file_.read_companion(*companion, why);
    known->second = bytes ? read_content(*bytes) : unusable(std::move(why));
  }
  return known->second;
}

GltfTextures::Content GltfTextures::unusable(std::string why) { return {FileKind::unknown, nullptr, std::move(why)}; }

GltfTextures::Content GltfTextures::read_content(std::string_view bytes) const {
  Content content;
  content.kind = file_kind(bytes.substr(0, kFileHead), bytes.size());
  if (content.kind != FileKind::png && content.kind != FileKind::jpeg && content.kind != FileKind::webp)
    return unusable("It is " + std::string(description(content.kind)) + ", and glTF knows PNG, JPEG and WebP");
  const auto all = std::as_bytes(std::span(bytes));
  auto opened = open_texture(std::make_shared<const std::vector<std::byte>>(all.begin(), all.end()), most_bytes_);
  if (auto* image = std::get_if<std::shared_ptr<const TextureImage>>(&opened)) content.image = std::move(*image);
  if (auto* problem = std::get_if<std::string>(&opened)) content.problem = std::move(*problem);
  return content;
}

}  // namespace tessera::proto
