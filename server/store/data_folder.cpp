#include "server/store/data_folder.h"

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>

#include "server/store/received_file.h"

namespace tessera::server {
namespace fs = std::filesystem;

DataFolder::DataFolder(const fs::path& path)
    : blobs_(path / "blobs"),
      scenes_(path / "scenes"),
      owners_(path / "owners"),
      images_(path / "images"),
      tiles_(path / "tiles"),
      set_aside_(path / "set-aside"),
      journal_(path / "journal.db") {
  fs::create_directories(blobs_);
  fs::create_directories(scenes_);
  fs::create_directories(images_);
  const fs::path lock = path / "lock";
  lock_ = FileDescriptor(::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock_) throw std::system_error(errno, std::generic_category(), lock.string());
  if (::flock(lock_.value(), LOCK_EX | LOCK_NB) != 0)
    throw std::runtime_error(path.string() + " is in use by another tesserad; give this one its own --data-dir");
  for (const fs::path& folder : {blobs_, scenes_, images_})
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().filename().string().starts_with(kReceivedFilePrefix)) fs::remove(entry.path());
}

bool DataFolder::has_traces_of_jobs() const {
  const auto has_files = [](const fs::path& folder) {
    std::error_code missing;
    return fs::directory_iterator(folder, missing) != fs::directory_iterator();
  };
  return has_files(images_) || has_files(tiles_);
}

}  // namespace tessera::server
