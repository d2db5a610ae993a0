#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "server/store/journal.h"
#include "server/store/shelf.h"

namespace tessera::server {

/// Finished images on disk: all planes as they are in memory, and the SHA-256 of that. Large ones are a file a job,
/// `<id>.film`; small ones lie in the journal, where they cost no syncs of their own. Safe to call from any number of
/// threads, for different jobs. Every failure of the file system is a std::system_error, and so is one to read an image
/// from the journal; of the journal otherwise it is a std::runtime_error.
class ImageStore {
 public:
  /// Keeps images in `folder`, which exists, and puts damaged ones into `set_aside`.
  ImageStore(std::filesystem::path folder, std::filesystem::path set_aside, const Journal& journal)
      : folder_(std::move(folder)), set_aside_(std::move(set_aside)), journal_(journal) {}

  /// An image that isn't going to change any more, as it is appended to the journal (`Journal::Append::image`); null
  /// when it is too large for that.
  static std::shared_ptr<const std::string> for_journal(const Film& film);

  /// Writes an image that isn't going to change any more, all of it or nothing, to outlive a power cut.
  void keep(const std::string& job, const Film& film) const;

  /// The jobs whose images are there.
  std::set<std::string> jobs() const;

  /// The image as one tile. Null when there is none, or it isn't what was written: then it is set aside, and the log
  /// says so.
  std::shared_ptr<const Film> load(const std::string& job) const;

  /// Of an image in the journal, that takes care.
  void remove(const std::string& job) const;

  /// Sets files aside of jobs that aren't known; which those were.
  std::vector<std::filesystem::path> set_strangers_aside(const std::set<std::string>& known) const;

  /// Looks through all images; those that are damaged are set aside, and told.
  Shelf::Scrubbed scrub(const std::function<void(const std::filesystem::path& file)>& is_damaged) const;

 private:
  std::optional<std::string> image_in_journal(const std::string& job) const;
  std::filesystem::path path_of(const std::string& job) const { return folder_ / (job + ".film"); }

  const std::filesystem::path folder_, set_aside_;
  const Journal& journal_;
};

}  // namespace tessera::server
