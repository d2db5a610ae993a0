#include "proto/import/gltf/file.h"

#include <utility>
#include <vector>

#include "proto/import/broken_file.h"
#include "proto/import/read_file.h"
#include "proto/wire/uri.h"

namespace tessera::proto {
namespace {

/// Metadata may nest as it likes, within reason.
constexpr std::uint32_t kDeepest = 512;
constexpr std::uintmax_t kLargestCompanion = 4ULL << 30;

/// Draco's and meshopt's best, strips of bytes for indices included, stay below.
constexpr std::uint64_t kMostPerByte = 256;
constexpr std::uint64_t kAllowance = 1 << 20;

}  // namespace

GltfFile::GltfFile(std::string_view json, std::uint64_t bytes, std::string_view name, const CompanionSource& companions,
                   const std::stop_token& stop)
    : name_(name),
      companions_(companions),
      stop_(stop),
      errors_(stop),
      document_(parsed(json, name, errors_)),
      notes_([this](std::size_t i) { return place(document_.pointer(static_cast<JsonDocument::Index>(i))); }),
      budget_(kAllowance + kMostPerByte * bytes) {
  refuse_if_broken();
}

JsonDocument GltfFile::parsed(std::string_view json, std::string_view name, FieldErrors& errors) {
  auto document = JsonDocument::parse(json, kDeepest, errors);
  if (document) return *std::move(document);
  std::vector<FieldError> faults = document.problem().errors;
  if (faults.empty()) faults.push_back({"", document.problem().detail});
  for (FieldError& fault : faults) fault.pointer = std::string(name) + fault.pointer;
  throw BrokenFile{std::move(faults)};
}

void GltfFile::refuse_if_broken() {
  if (errors_.empty()) return;
  std::vector<FieldError> faults = std::move(errors_).as_problem("file").errors;
  for (FieldError& fault : faults) fault.pointer = place(fault.pointer);
  throw BrokenFile{std::move(faults)};
}

std::optional<GltfFile::Companion> GltfFile::find_companion(std::string_view uri, std::string& why) {
  CompanionName companion = read_relative_uri(uri);
  if (!companion.refusal.empty()) {
    why = "The URI " + in_quotes(uri) + " may not be used: " + companion.refusal;
    return std::nullopt;
  }
  auto file = companions_ ? companions_(companion.name) : std::nullopt;
  if (file) return Companion{std::move(companion.name), *std::move(file)};
  why = "The file " + in_quotes(companion.name) + " is missing";
  return std::nullopt;
}

std::shared_ptr<const std::string> GltfFile::read_companion(const Companion& companion, std::string& why) {
  const auto [known, is_new] = companions_read_.try_emplace(companion.file.path);
  if (auto bytes = known->second.lock()) return bytes;
  try {
    auto bytes =
        std::make_shared<const std::string>(read_file(companion.file, companion.name, kLargestCompanion, stop_));
    if (is_new) budget_ += kMostPerByte * bytes->size();
    known->second = bytes;
    return bytes;
  } catch (const BrokenFile& broken) {
    why = "The file " + in_quotes(companion.name) + " can't be read: " + broken.errors.front().detail;
    return nullptr;
  }
}

bool GltfFile::take(std::uint64_t bytes, const JsonCursor& where) {
  if (bytes <= budget_) {
    budget_ -= bytes;
    return true;
  }
  budget_ = 0;
  return where.error("This takes far more memory than files of this size hold: the counts can't be meant.");
}

}  // namespace tessera::proto
