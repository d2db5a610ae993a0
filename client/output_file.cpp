#include "client/output_file.h"

#include <cerrno>
#include <string>

#include <fcntl.h>
#include <unistd.h>

#include "client/failure.h"
#include "client/interrupt.h"

namespace tessera::client {
namespace {

namespace fs = std::filesystem;

std::error_code last_error() { return {errno, std::generic_category()}; }

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
  throw Failure(Failure::Kind::local_file, "can't write " + path.string() + ": " + why);
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

bool is_special(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error) && !fs::is_regular_file(path, error);
}

std::error_code write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return last_error();
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

/// Writes what is called `name` to `path`.
void write(const fs::path& path, std::string_view bytes, const fs::path& name) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(name, last_error().message());
  std::error_code error = write_all(descriptor, bytes);
  if (close(descriptor) != 0 && !error) error = last_error();  // Some file systems notice a quota only then.
  if (error) fail(name, error.message());
}

}  // namespace

void expect_writable(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) fail(path, "it is a folder");
  const fs::path place = is_special(path) ? path : folder_of(path);
  if (access(place.c_str(), W_OK) != 0) fail(path, last_error().message());
}

void write_atomically(const fs::path& path, std::string_view bytes) {
  if (is_special(path)) return write(path, bytes, path);

  const InterruptsWait wait;  // So that no part stays behind.
  // Beside what a symbolic link leads to, so that the link stays one.
  std::error_code error;
  const fs::path target = fs::is_symlink(path, error) ? fs::weakly_canonical(path, error) : path;
  const fs::path part = target.string() + ".part-" + std::to_string(getpid());
  try {
    write(part, bytes, path);
    fs::rename(part, target);
  } catch (const fs::filesystem_error& e) {
    fs::remove(part, error);
    fail(path, e.code().message());
  } catch (const Failure&) {
    fs::remove(part, error);
    throw;
  }
}

std::error_code write_to_stdout(std::string_view bytes) { return write_all(STDOUT_FILENO, bytes); }

}  // namespace tessera::client
