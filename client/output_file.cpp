#include "client/output_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

#include <unistd.h>

#include "client/failure.h"

namespace tessera::client {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
  throw Failure(Failure::Kind::local_file, "can't write " + path.string() + ": " + why);
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

bool is_special(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error) && !fs::is_regular_file(path, error);
}

void write(const fs::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) fail(path, std::strerror(errno));
}

}  // namespace

void expect_writable(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) fail(path, "it is a folder");
  const fs::path place = is_special(path) ? path : folder_of(path);
  if (access(place.c_str(), W_OK) != 0) fail(path, std::strerror(errno));
}

void write_atomically(const fs::path& path, std::string_view bytes) {
  if (is_special(path)) return write(path, bytes);

  // Beside what a symbolic link leads to, so that the link stays one.
  std::error_code error;
  const fs::path target = fs::is_symlink(path, error) ? fs::weakly_canonical(path, error) : path;
  const fs::path part = target.string() + ".part-" + std::to_string(getpid());
  try {
    write(part, bytes);
    fs::rename(part, target);
  } catch (const fs::filesystem_error& e) {
    fs::remove(part, error);
    fail(path, e.code().message());
  } catch (const Failure&) {
    fs::remove(part, error);
    throw;
  }
}

}  // namespace tessera::client
