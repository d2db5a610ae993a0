#include "server/handlers/zip_archive.h"

#include <algorithm>
#include <array>
#include <clocale>
#include <filesystem>
#include <new>
#include <set>
#include <span>
#include <utility>

#include <archive.h>
#include <archive_entry.h>

#include "proto/wire/abandoned.h"
#include "proto/wire/printable.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

constexpr std::size_t kLongestName = 1024;
constexpr std::size_t kPieceBytes = 64 << 10;
/// Times that what is in an archive may be as large, beside what any archive may hold.
constexpr std::uint64_t kMostRatio = 200;
constexpr std::uint64_t kAnyway = 16 << 20;

/// What stands in the way of unpacking.
struct Refused {
  Problem problem;
};

[[noreturn]] void refuse(std::string why) {
  throw Refused{{ProblemCode::malformed_request, "The archive can't be used. " + std::move(why), {}}};
}

/// libarchive tells names in the characters of the locale, which may be the C locale's: this thread gets UTF-8.
class Utf8 {
 public:
  Utf8() : locale_(::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)) {
    if (locale_) before_ = ::uselocale(locale_);
  }
  ~Utf8() {
    if (!locale_) return;
    ::uselocale(before_);
    ::freelocale(locale_);
  }
  Utf8(const Utf8&) = delete;
  Utf8& operator=(const Utf8&) = delete;

 private:
  locale_t locale_, before_ = nullptr;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : archive_(archive_read_new(), archive_read_free) {
    if (!archive_) throw std::bad_alloc();
    check(archive_read_support_format_zip_seekable(archive_.get()));
    check(archive_read_open_memory(archive_.get(), bytes.data(), bytes.size()));
  }

  /// The next entry, or null at the end.
  archive_entry* next() {
    archive_entry* entry = nullptr;
    const int result = archive_read_next_header(archive_.get(), &entry);
    if (result == ARCHIVE_EOF) return nullptr;
    check(result);
    return entry;
  }

  /// How the entry is packed, as libarchive says it after the header.
  std::string_view format() const {
    const char* name = archive_format_name(archive_.get());
    return name ? name : "";
  }

  /// The next bytes of the entry, none at its end.
  std::span<const std::byte> read() {
    const la_ssize_t size = archive_read_data(archive_.get(), piece_.data(), piece_.size());
    if (size < 0) fail();
    return std::span(piece_).first(static_cast<std::size_t>(size));
  }

 private:
  /// What a header is warned of are names that can't be told in the locale's characters.
  void check(int result) const {
    if (result != ARCHIVE_OK && result != ARCHIVE_WARN) fail();
  }
  [[noreturn]] void fail() const {
    const char* why = archive_error_string(archive_.get());
    refuse(proto::printable(why ? why : "It is broken") + '.');
  }

  Utf8 utf8_;
  std::unique_ptr<archive, decltype(&archive_read_free)> archive_;
  std::array<std::byte, kPieceBytes> piece_;
};

std::string name_of(archive_entry* entry) {
  const char* name = archive_entry_pathname_utf8(entry);
  if (!name) name = archive_entry_pathname(entry);
  if (!name) refuse("It has a file whose name can't be read; name files in UTF-8.");
  return with_slashes(name);
}

/// What systems put beside the files that people mean.
bool is_clutter(std::string_view name) {
  return name.starts_with("__MACOSX/") || name == ".DS_Store" || name.ends_with("/.DS_Store");
}

void check_entry(archive_entry* entry, const std::string& name, std::string_view format) {
  const std::string called = '"' + proto::printable(name) + '"';
  if (const std::string why = why_unsafe(name); !why.empty()) refuse("Its file " + called + ' ' + why);
  if (archive_entry_is_encrypted(entry)) refuse("Its file " + called + " is encrypted.");
  if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry) || archive_entry_symlink(entry))
    refuse("What it calls " + called + " is a link, or no file at all.");
  if (!format.ends_with("(uncompressed)") && !format.ends_with("(deflation)"))
    refuse("Its file " + called + " isn't stored or compressed by deflate, which are the methods that are unpacked.");
}

}  // namespace

std::string with_slashes(std::string name) {
  std::ranges::replace(name, '\\', '/');
  return name;
}

std::string why_unsafe(std::string_view name) {
  if (name.empty()) return "has no name.";
  if (name.size() > kLongestName) return "has a name of more than " + std::to_string(kLongestName) + " bytes.";
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (std::ranges::any_of(name, is_control)) return "has control characters in its name.";
  if (!proto::is_utf8(name)) return "has a name that isn't UTF-8.";
  if (name.find('\\') != name.npos) return "has a backslash in its name; separate folders by slashes.";
  if (name.starts_with('/') || (name.size() > 1 && name[1] == ':')) return "has an absolute path; make it relative.";
  for (const std::filesystem::path& step : std::filesystem::path(name))
    if (step == "..") return "climbs out of its folder; leave \"..\" out.";
  return "";
}

Result<std::vector<NamedFile>> unpack_zip(std::string_view archive, std::uint64_t most_bytes, const NewFile& new_file,
                                          const std::stop_token& stop) {
  const std::uint64_t most = std::min(most_bytes, kAnyway + kMostRatio * archive.size());
  std::vector<NamedFile> files;
  std::set<std::string> names;
  std::uint64_t total = 0;
  MemoryOfFiles memory;
  try {
    const auto reader = std::make_unique<Reader>(archive);
    for (std::size_t entries = 0; archive_entry* entry = reader->next(); ++entries) {
      if (entries == kMostFiles)
        throw Refused{{ProblemCode::payload_too_large,
                       "The archive has more than " + std::to_string(kMostFiles) + " files.",
                       {}}};
      std::string name = name_of(entry);
      if (archive_entry_filetype(entry) == AE_IFDIR || is_clutter(name)) continue;
      check_entry(entry, name, reader->format());
      name = std::filesystem::path(name).lexically_normal().generic_string();
      if (!names.insert(name).second) refuse("Two of its files are called \"" + proto::printable(name) + "\".");
      files.push_back({std::move(name), {}, new_file()});
      for (auto bytes = reader->read(); !bytes.empty(); bytes = reader->read()) {
        proto::throw_if_abandoned(stop);
        total += bytes.size();
        if (total > most)
          throw Refused{{ProblemCode::payload_too_large,
                         "The archive holds more than " + std::to_string(most) +
                             " bytes, which is more than is taken of one of its size.",
                         {}}};
        files.back().file->write(bytes);
      }
      memory.settle(*files.back().file);
    }
  } catch (Refused& refused) {
    return std::move(refused.problem);
  }
  return files;
}

}  // namespace tessera::server
