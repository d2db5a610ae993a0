#include "server/isolation/isolated_reader.h"

#include <algorithm>
#include <array>
#include <map>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>

#include "core/io/module_missing.h"
#include "core/scene/light.h"
#include "proto/import/flat_import.h"
#include "proto/wire/printable.h"
#include "server/isolation/read_requests.h"
#include "server/isolation/shared_memory.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

/// Beside what a file holds and what becomes of it: libraries, threads, buffers.
constexpr std::uint64_t kMemoryAnyway = 512 << 20;
/// What is copied from shared memory rather than mapped: mappings are few, and have whole pages.
constexpr std::size_t kSmallOutcome = 256 << 10;
constexpr std::uint32_t kTryAgain = 5;  ///< Seconds.

using Outcome = std::variant<ReadReply, Isolation::Failure>;

/// Has a request done, in a worker that is prepared if need be. Throws what `Isolation::run` throws, `ModuleMissing`,
/// and std::bad_alloc where the system has no memory.
Outcome run(const Isolation& isolation, const ReadRequest& request, Isolation::Preparation preparation,
            std::span<const int> files, const std::stop_token& stop, const Isolation::AnswerTo& answer = {}) {
  using Kind = Isolation::Failure::Kind;
  const std::string body = encoded(request);
  for (;;) {
    auto said =
        isolation.run({preparation, body, files, std::chrono::seconds(request.allowance.seconds)}, stop, answer);
    if (auto* failure = std::get_if<Isolation::Failure>(&said)) return std::move(*failure);
    try {
      ReadReply reply = read_reply(std::get<std::string>(said));
      if (!reply.missing_library.empty()) throw ModuleMissing(proto::printable(reply.missing_library));
      if (reply.is_out_of_memory) throw std::bad_alloc();
      if (reply.is_beyond_allowance) return Isolation::Failure{Kind::killed, "took more memory than it may"};
      if (!reply.wants_preparation || preparation == Isolation::Preparation::prepared) return reply;
    } catch (const proto::NotFlat&) {
      return Isolation::Failure{Kind::crashed, "came to nothing that makes sense"};
    }
    preparation = Isolation::Preparation::prepared;
  }
}

Isolation::Failure makes_no_sense() { return {Isolation::Failure::Kind::crashed, "came to nothing that makes sense"}; }

/// What lies in shared memory, which nobody changes any more, for as long as it is held. Nothing where somebody might.
struct Content {
  std::span<const std::byte> bytes;
  std::shared_ptr<const void> hold;
};
std::optional<Content> settled_content(const FileDescriptor& memory) {
  const std::uint64_t size = size_of(memory);
  if (size <= kSmallOutcome) {  // Freezing may wait for all processors.
    const auto copy = std::make_shared<const std::vector<std::byte>>(content_of(memory, size));
    return Content{*copy, copy};
  }
  if (!freeze(memory)) return std::nullopt;
  const std::uint64_t settled = size_of(memory);
  auto mapped = map_part(memory.value(), 0, settled);
  return Content{{mapped.get(), settled}, mapped};
}

FileDescriptor new_shared_memory(std::span<const std::byte> bytes = {}) try {
  return make_shared_memory(bytes);
} catch (const std::system_error& error) {
  throw NoWorker(error.what());
}

std::string sentence(const Isolation::Failure& failure) { return "The process that read it " + failure.how + "."; }

Problem no_worker(const NoWorker& why) {
  return {ProblemCode::reader_unavailable,
          "There is no process to read files in: " + std::string(why.what()) + "; try again later.",
          {},
          kTryAgain};
}

Problem no_memory(std::string_view name) {
  return {ProblemCode::out_of_memory_budget, "There is no memory left to read " + std::string(name) + '.', {}};
}

/// Opens the files that a model names, as they are asked for.
class AnsweredCompanions {
 public:
  explicit AnsweredCompanions(const proto::CompanionSource& source) : source_(source) {}

  Isolation::Answer find(std::string_view name) {
    const auto found = source_ ? source_(name) : std::nullopt;
    if (!found) return {encoded_number(0), {}};
    const auto [number, is_new] = numbers_.try_emplace(found->path, static_cast<std::uint32_t>(numbers_.size() + 1));
    if (!is_new) return {encoded_number(number->second), {}};
    // Held until the next one is: the worker has it by then.
    last_ = FileDescriptor(::open(found->path.c_str(), O_RDONLY | O_CLOEXEC));
    Isolation::Answer answer{encoded_number(number->second), {}};
    if (last_) answer.files.push_back(last_.value());
    return answer;
  }

 private:
  const proto::CompanionSource& source_;
  std::map<std::filesystem::path, std::uint32_t> numbers_;
  FileDescriptor last_;
};

/// Where the file of an image lies.
struct ImageSource {
  std::shared_ptr<const std::vector<std::byte>> bytes = nullptr;  ///< Of a small one;
  std::shared_ptr<const FileDescriptor> file = nullptr;           ///< of a large one.
  std::uint64_t offset = 0, size = 0;
  std::string name = {};
};

template <typename T>
Texels texels_in(const Content& content, const ReadReply& reply) {
  const std::span values(reinterpret_cast<const T*>(content.bytes.data()), content.bytes.size() / sizeof(T));
  return {reply.width, reply.height, reply.channels, SharedValues<T>(values, content.hold)};
}

bool are_valid(const Texels& texels) {
  const auto* floats = std::get_if<SharedValues<float>>(&texels.values);
  return !floats || std::ranges::all_of(*floats, [](float v) { return v >= 0 && v <= kLargestLight; });
}

/// Nothing where the reply doesn't fit what is there.
std::optional<Texels> texels_of(const ReadReply& reply, const FileDescriptor& outcome, std::uint64_t most_bytes) {
  if (reply.width == 0 || reply.height == 0 || reply.channels == 0 || reply.channels > 4) return std::nullopt;
  const std::uint64_t count = std::uint64_t{reply.width} * reply.height;
  if (count > most_bytes / reply.channels) return std::nullopt;
  const auto content = settled_content(outcome);
  if (!content || content->bytes.size() > most_bytes ||
      content->bytes.size() != count * reply.channels * reply.channel_bytes)
    return std::nullopt;
  std::optional<Texels> texels;
  if (reply.channel_bytes == 1) texels = texels_in<std::uint8_t>(*content, reply);
  if (reply.channel_bytes == 2) texels = texels_in<std::uint16_t>(*content, reply);
  if (reply.channel_bytes == 4) texels = texels_in<float>(*content, reply);
  if (texels && !are_valid(*texels)) return std::nullopt;
  return texels;
}

TextureImage::Decoded decode_isolated(const Isolation& isolation, const ImageSource& source, std::uint64_t most_bytes,
                                      std::uint32_t seconds) try {
  std::optional<FileDescriptor> copy;
  if (source.bytes) copy = new_shared_memory(*source.bytes);
  const FileDescriptor outcome = new_shared_memory();
  const std::array files{copy ? copy->value() : source.file->value(), outcome.value()};
  const ReadRequest request{.kind = ReadKind::image,
                            .allowance = {kMemoryAnyway + source.size + 4 * most_bytes, most_bytes, seconds},
                            .name = source.name,
                            .most_bytes = most_bytes,
                            .offset = source.offset,
                            .bytes = source.size};
  const Outcome done = run(isolation, request, Isolation::Preparation::prepared, files, {});
  if (const auto* failure = std::get_if<Isolation::Failure>(&done)) return {{}, sentence(*failure)};
  const auto& reply = std::get<ReadReply>(done);
  if (reply.width == 0) return {{}, proto::printable(reply.problem)};
  auto texels = texels_of(reply, outcome, most_bytes);
  if (!texels) return {{}, sentence(makes_no_sense())};
  return {*std::move(texels), proto::printable(reply.problem)};
} catch (const NoWorker& why) {
  throw NoWorker(no_worker(why).detail);
}

/// What kept a file from being read, told in its handler; whatever else it is goes on.
Problem problem_caught(std::string_view display_name) try { throw; } catch (const NoWorker& why) {
  return no_worker(why);
} catch (const std::bad_alloc&) {
  return no_memory(display_name);
} catch (const ModuleMissing& error) {
  return Problem{ProblemCode::internal_error, error.what(), {}};
}

std::uint64_t file_size(const FileDescriptor& file) { return file ? size_of(file) : 0; }

}  // namespace

Result<proto::Imported> IsolatedReader::import(const std::filesystem::path& path, proto::FileFormat format,
                                               std::string_view display_name, const proto::CompanionSource& companions,
                                               const std::stop_token& stop, const proto::ImportOptions& options,
                                               std::uint64_t texture_bytes) const try {
  const FileDescriptor input(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), outcome = new_shared_memory();
  const auto large_images = std::make_shared<const FileDescriptor>(new_shared_memory());
  const std::string name = proto::printable(display_name);
  const auto cannot_for = [&](const std::string& why) {
    return Problem{ProblemCode::invalid_document, name + " can't be imported.", {{name, why}}};
  };
  const auto cannot = [&](const Isolation::Failure& failure) { return cannot_for(sentence(failure)); };
  if (!input) return cannot_for("The file can't be opened.");
  const std::uint64_t size = file_size(input);
  const ReadRequest request{.kind = ReadKind::model,
                            .allowance = {kMemoryAnyway + 4 * size + 2 * texture_bytes,
                                          kMemoryAnyway + 4 * size + 2 * texture_bytes, seconds_},
                            .name = std::string(display_name),
                            .most_bytes = texture_bytes,
                            .format = format,
                            .options = options};
  AnsweredCompanions answered(companions);
  const std::array files{input.value(), outcome.value(), large_images->value()};
  const Outcome done = run(isolation_, request, Isolation::Preparation::bare, files, stop,
                           [&](std::string_view asked) { return answered.find(asked); });
  if (const auto* failure = std::get_if<Isolation::Failure>(&done)) return cannot(*failure);
  const auto content = settled_content(outcome);
  if (!content) return cannot(makes_no_sense());
  const std::uint64_t large_bytes = size_of(*large_images);
  std::uint64_t offset = 0;
  const auto make_image = [&](const proto::FlatImage& image) {
    ImageSource source{.size = image.file_bytes, .name = image.name};
    if (image.file.empty()) {
      proto::FlatReader::expect(image.file_bytes <= large_bytes && offset <= large_bytes - image.file_bytes);
      source.file = large_images;
      source.offset = offset;
      offset += (image.file_bytes + kLargeImageAlignment - 1) / kLargeImageAlignment * kLargeImageAlignment;
    } else {
      source.bytes = std::make_shared<const std::vector<std::byte>>(image.file.begin(), image.file.end());
    }
    return std::make_shared<const TextureImage>(
        image.bytes, [&isolation = isolation_, source = std::move(source), bytes = image.bytes, seconds = seconds_] {
          return decode_isolated(isolation, source, bytes, seconds);
        });
  };
  try {
    return proto::unflatten_import(content->bytes, make_image);
  } catch (const proto::NotFlat&) {
    return cannot(makes_no_sense());
  }
} catch (...) {
  return problem_caught(display_name);
}

Result<std::shared_ptr<const EnvironmentMap>> IsolatedReader::environment(const std::filesystem::path& path,
                                                                          std::string_view display_name,
                                                                          std::uint64_t max_bytes,
                                                                          const std::stop_token& stop) const try {
  const auto cannot = [&](const std::string& why) {
    return Problem{ProblemCode::invalid_document,
                   proto::printable(std::string(display_name) + " can't be read as an environment: " + why),
                   {}};
  };
  const FileDescriptor input(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), outcome = new_shared_memory();
  if (!input) return cannot("The file can't be opened.");
  const std::uint64_t size = file_size(input);
  const ReadRequest request{
      .kind = ReadKind::environment,
      .allowance = {kMemoryAnyway + 2 * size + 4 * max_bytes, kMemoryAnyway + max_bytes, seconds_},
      .name = std::string(display_name),
      .most_bytes = max_bytes};
  const std::array files{input.value(), outcome.value()};
  const Outcome done = run(isolation_, request, Isolation::Preparation::prepared, files, stop);
  if (const auto* failure = std::get_if<Isolation::Failure>(&done)) return cannot(sentence(*failure));
  const auto content = settled_content(outcome);
  if (!content) return cannot(sentence(makes_no_sense()));
  try {
    return proto::unflatten_environment(content->bytes);
  } catch (const proto::NotFlat&) {
    return cannot(sentence(makes_no_sense()));
  }
} catch (...) {
  return problem_caught(display_name);
}

}  // namespace tessera::server
