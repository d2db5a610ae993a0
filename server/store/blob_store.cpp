#include "server/store/blob_store.h"

#include <algorithm>
#include <fstream>
#include <span>
#include <vector>

#include "proto/wire/abandoned.h"
#include "server/http/lane.h"
#include "server/store/file_hash.h"

namespace tessera::server {
namespace fs = std::filesystem;
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr std::size_t kCopiedBytes = 256 << 10;

Problem refused(std::string detail) { return {ProblemCode::invalid_document, std::move(detail), {}}; }

bool climbs(const fs::path& path) { return std::ranges::find(path, fs::path("..")) != path.end(); }

/// Whether `path` is `root` or lies under it; both canonical.
bool is_within(const fs::path& path, const fs::path& root) {
  return std::ranges::mismatch(root, path).in1 == root.end();
}

bool is_whole_blob(int file, const std::string& name, const std::stop_token& stop) {
  return hash_digits(hash_open_file(file, 0, stop)) == name;
}

std::string why_absent(Shelf::State state) {
  if (state == Shelf::State::damaged)
    return " was damaged on the server's disk and has been set aside; upload it again";
  return " has expired; upload it again";
}

}  // namespace

Problem no_such_blob(const proto::ContentHash& hash) {
  return refused("There is no blob " + hash + "; upload it first with PUT /v1/blobs/" + hash + ".");
}

BlobStore::BlobStore(fs::path folder, fs::path set_aside, const std::optional<fs::path>& asset_root,
                     const proto::AssetReader& reader)
    : folder_(std::move(folder)),
      shelf_(folder_, "", is_whole_blob, std::move(set_aside)),
      asset_root_(asset_root ? fs::canonical(*asset_root) : fs::path()),
      reader_(reader) {}

std::unique_ptr<ReceivedFile> BlobStore::receive() const { return std::make_unique<ReceivedFile>(folder_); }

proto::Result<BlobStore::Put> BlobStore::put(const proto::ContentHash& hash, ReceivedFile& file,
                                             const std::stop_token& abandoned) {
  if (file.finish() != hash)
    return Problem{ProblemCode::hash_mismatch,
                   "The bytes received are " + file.finish() + ", not " + hash +
                       "; send the file whose hash is in the path, or correct the path.",
                   {}};
  return shelf_.keep(hash_digits(hash), file, abandoned) ? Put::known : Put::created;
}

proto::Result<proto::SourceFile> BlobStore::capture(const proto::SourceFile& file,
                                                    const std::stop_token& abandoned) const {
  const std::string name = hash_digits(file.hash);
  auto hold = shelf_.hold(name);
  if (shelf_.find(name, abandoned).state != Shelf::State::whole) {
    FileBudget::spend(fs::file_size(file.path));
    std::ifstream from(file.path, std::ios::binary);
    ReceivedFile copy(folder_);
    std::vector<char> piece(kCopiedBytes);
    while (from.read(piece.data(), static_cast<std::streamsize>(piece.size())), from.gcount() > 0) {
      proto::throw_if_abandoned(abandoned);
      copy.write(std::as_bytes(std::span(piece.data(), static_cast<std::size_t>(from.gcount()))));
    }
    if (copy.finish() != file.hash) return refused("A file changed while it was read; send the scene again.");
    shelf_.keep(name, copy, abandoned);
  }
  return proto::SourceFile{shelf_.path_of(name), file.hash, std::move(hold)};
}

proto::Result<proto::SourceFile> BlobStore::blob(const proto::ContentHash& hash, const std::stop_token& stop) const {
  if (!proto::is_content_hash(hash)) return refused("Not a content hash: write sha256: and 64 lower-case hex digits.");
  const std::string name = hash_digits(hash);
  auto found = shelf_.find(name, stop);
  if (found.state == Shelf::State::missing) return no_such_blob(hash);
  if (found.state != Shelf::State::whole)
    return refused("The blob " + hash + why_absent(found.state) + " with PUT /v1/blobs/" + hash + ".");
  return proto::SourceFile{shelf_.path_of(name), hash, std::move(found.hold)};
}

proto::Result<proto::SourceFile> BlobStore::asset(std::string_view relative_path, const std::stop_token& stop) const {
  if (asset_root_.empty())
    return refused(
        "This server has no asset root, so files can't be named by path; upload the file and name it by blob.");
  if (relative_path.empty() || relative_path.find('\0') != std::string_view::npos)
    return refused("Give the path of a file, relative to the asset root.");
  const fs::path relative(relative_path);
  if (relative.is_absolute() || climbs(relative))
    return refused("The path has to stay under the asset root: make it relative, without \"..\".");
  std::error_code error;
  // The same words for a missing file and for a link that leaves the root, which says nothing of what lies outside.
  const Problem missing = refused("There is no such file under the asset root.");
  const fs::path path = fs::canonical(asset_root_ / relative, error);
  if (error || !is_within(path, asset_root_) || !fs::is_regular_file(path, error)) return missing;
  FileBudget::spend(fs::file_size(path, error));
  auto hash = proto::hash_file(path, stop);
  if (!hash) return refused("The file can't be read.");
  return proto::SourceFile{path, *std::move(hash)};
}

}  // namespace tessera::server
