#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/film/film.h"

namespace tessera::server {

/// Finished images on disk, one file a job: `<id>.film`, which holds all planes as they are in memory, and the SHA-256
/// of that. Safe to call from any number of threads, for different jobs. Every failure of the file system is a
/// std::system_error.
class ImageStore {
 public:
  /// Keeps images in `folder`, which exists, and puts damaged ones into `set_aside`.
  ImageStore(std::filesystem::path folder, std::filesystem::path set_aside)
      : folder_(std::move(folder)), set_aside_(std::move(set_aside)) {}

  /// Writes an image that isn't going to change any more, all of it or nothing, to outlive a power cut.
  void keep(const std::string& job, const Film& film) const;

  bool has(const std::string& job) const;

  /// The image as one tile. Null when there is none, or its file isn't what was written: then it is set aside, and the
  /// log says so.
  std::shared_ptr<const Film> load(const std::string& job) const;

  void remove(const std::string& job) const;

 private:
  std::filesystem::path path_of(const std::string& job) const { return folder_ / (job + ".film"); }
  void put_aside(const std::string& job, const std::string& why) const;

  const std::filesystem::path folder_, set_aside_;
};

}  // namespace tessera::server
