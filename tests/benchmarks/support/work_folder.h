#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace tessera::bench {

/// An empty folder for what a benchmark writes on the way; it goes with this.
class WorkFolder {
 public:
  explicit WorkFolder(const std::string& benchmark)
      : path_(std::filesystem::temp_directory_path() / ("tessera-bench-" + benchmark)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace tessera::bench
