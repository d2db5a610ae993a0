#include "server/isolation/read_requests.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/io/read_texture.h"
#include "proto/import/environment.h"
#include "proto/import/flat_archive.h"
#include "proto/import/flat_import.h"
#include "server/isolation/shared_memory.h"

namespace tessera::proto {

template <>
inline constexpr FileFormat kLastOf<FileFormat> = FileFormat::stl;
template <>
inline constexpr server::ReadKind kLastOf<server::ReadKind> = server::ReadKind::image;

template <typename A>
void flatten(A& a, typename A::template Of<ImportOptions>& o) {
  a(o.smooth, o.variant, o.scene);
}

}  // namespace tessera::proto

namespace tessera::server {

template <typename A>
void flatten(A& a, typename A::template Of<Allowance>& l) {
  a(l.memory, l.written_bytes, l.seconds);
}
template <typename A>
void flatten(A& a, typename A::template Of<ReadRequest>& r) {
  a(r.kind, r.allowance, r.name, r.most_bytes, r.offset, r.bytes, r.format, r.options);
}
template <typename A>
void flatten(A& a, typename A::template Of<ReadReply>& r) {
  a(r.wants_preparation, r.is_out_of_memory, r.is_beyond_allowance, r.missing_library, r.width, r.height, r.channels,
    r.channel_bytes, r.problem);
}

namespace {

template <typename T>
std::string encode(const T& value) {
  proto::FlatWriter writer;
  writer(value);
  std::string bytes;
  writer.finish([&](std::span<const std::byte> piece) {
    bytes.append(reinterpret_cast<const char*>(piece.data()), piece.size());
  });
  return bytes;
}

template <typename T>
T decode(std::string_view body) {
  proto::FlatReader reader(std::as_bytes(std::span(body)));
  T value;
  reader(value);
  return value;
}

/// Mapped, as whoever truncates the file meanwhile harms this process alone.
proto::InputFile mapped(std::filesystem::path path, const FileDescriptor& file) {
  const std::uint64_t size = size_of(file);
  auto bytes = map_part(file.value(), 0, size);
  return {std::move(path), {reinterpret_cast<const char*>(bytes.get()), size}, bytes};
}

/// The files that a model names, each once however often it asks for it.
class AskedCompanions {
 public:
  explicit AskedCompanions(const Worker& worker) : worker_(worker) {}

  std::optional<proto::InputFile> find(std::string_view name) {
    if (name.size() > kLongestName) return std::nullopt;
    Message answer = worker_.ask(name);
    const std::uint32_t number = decoded_number(answer.body);
    if (number == 0) return std::nullopt;
    files_.resize(std::max<std::size_t>(files_.size(), number + 1));
    if (!answer.files.empty() && !files_[number]) files_[number] = std::move(answer.files.front());
    const std::filesystem::path path = "/dev/null/" + std::to_string(number);  // Where nothing can be.
    if (!files_[number]) return proto::InputFile(path);
    return mapped(path, files_[number]);
  }

 private:
  static constexpr std::size_t kLongestName = 4096;  // As long as paths may be.

  const Worker& worker_;
  std::vector<FileDescriptor> files_;
};

void write_outcome(const proto::FlatWriter& writer, const Message& request) {
  const int outcome = request.files.at(kOutcome).value();
  std::vector<std::byte> small;  // Of which there are many.
  constexpr std::size_t kBuffer = 256 << 10;
  const auto flush = [&] {
    write_all(outcome, small);
    small.clear();
  };
  writer.finish([&](std::span<const std::byte> piece) {
    if (small.size() + piece.size() > kBuffer) flush();
    if (piece.size() > kBuffer) return write_all(outcome, piece);
    small.insert(small.end(), piece.begin(), piece.end());
  });
  flush();
}

void write_large_images(const std::vector<std::span<const std::byte>>& images, const Message& request) {
  const std::vector<std::byte> padding(kLargeImageAlignment);
  for (const auto& image : images) {
    write_all(request.files.at(kLargeImages).value(), image);
    const std::size_t past = image.size() % kLargeImageAlignment;
    if (past > 0) write_all(request.files.at(kLargeImages).value(), std::span(padding).subspan(past));
  }
}

/// Whether it is worth while to try again in a worker that is prepared. A missing library is all that is an
/// internal error.
template <typename T>
bool wants_preparation(const proto::Result<T>& result, const Worker& worker) {
  return !worker.is_prepared() && !result && result.problem().code == proto::ProblemCode::internal_error;
}

template <typename T>
bool is_out_of_memory(const proto::Result<T>& result) {
  return !result && result.problem().code == proto::ProblemCode::out_of_memory_budget;
}

ReadReply read_model(const Worker& worker, const ReadRequest& wanted, const Message& request) {
  AskedCompanions companions(worker);
  const proto::Result<proto::Imported> imported = proto::import_file(
      mapped("model", request.files.at(kInput)), wanted.format, wanted.name,
      [&](std::string_view name) { return companions.find(name); }, {}, wanted.options, wanted.most_bytes);
  if (wants_preparation(imported, worker)) return {.wants_preparation = true};
  if (is_out_of_memory(imported)) throw std::bad_alloc();
  proto::FlatWriter writer;
  std::vector<std::span<const std::byte>> large_images;
  flatten_import(imported, writer, large_images);
  write_outcome(writer, request);
  write_large_images(large_images, request);
  return {};
}

ReadReply read_environment_map(const Worker& worker, const ReadRequest& wanted, const Message& request) {
  const auto map =
      proto::import_environment(mapped("environment", request.files.at(kInput)), wanted.name, wanted.most_bytes);
  if (wants_preparation(map, worker)) return {.wants_preparation = true};
  if (is_out_of_memory(map)) throw std::bad_alloc();
  proto::FlatWriter writer;
  flatten_environment(map, writer);
  write_outcome(writer, request);
  return {};
}

ReadReply read_image(const ReadRequest& wanted, const Message& request) {
  const auto file = map_part(request.files.at(kInput).value(), wanted.offset, wanted.bytes);
  // The texels lie in the outcome from the beginning.
  const auto room = [&](std::size_t bytes) { return map_to_write(request.files.at(kOutcome).value(), bytes); };
  const TextureImage::Decoded decoded =
      decode_texture(wanted.name, {file.get(), wanted.bytes}, wanted.most_bytes, room);
  const Texels& texels = decoded.texels;
  const auto channel_bytes = static_cast<std::uint32_t>(std::visit(
      [](const auto& values) { return sizeof(typename std::decay_t<decltype(values)>::value_type); }, texels.values));
  return {.width = texels.width,
          .height = texels.height,
          .channels = texels.channels,
          .channel_bytes = channel_bytes,
          .problem = decoded.problem};
}

}  // namespace

std::string encoded(const ReadRequest& request) { return encode(request); }
std::string encoded(const ReadReply& reply) { return encode(reply); }
ReadRequest read_request(std::string_view body) { return decode<ReadRequest>(body); }
ReadReply read_reply(std::string_view body) { return decode<ReadReply>(body); }

std::string encoded_number(std::uint32_t number) { return {reinterpret_cast<const char*>(&number), sizeof(number)}; }

std::uint32_t decoded_number(std::string_view body) {
  std::uint32_t number = 0;
  if (body.size() == sizeof(number)) std::memcpy(&number, body.data(), sizeof(number));
  return number;
}

void read_in_worker(Worker& worker, Message request) {
  const ReadRequest wanted = read_request(request.body);
  if (!worker.why_not_prepared().empty())
    return worker.done(encoded(ReadReply{.missing_library = worker.why_not_prepared()}));
  const bool limits_memory = limit_to(wanted.allowance);
  ReadReply reply;
  try {
    switch (wanted.kind) {
      case ReadKind::model:
        reply = read_model(worker, wanted, request);
        break;
      case ReadKind::environment:
        reply = read_environment_map(worker, wanted, request);
        break;
      case ReadKind::image:
        reply = read_image(wanted, request);
        break;
    }
  } catch (const std::bad_alloc&) {
    reply = {};
    (limits_memory ? reply.is_beyond_allowance : reply.is_out_of_memory) = true;
  }
  worker.done(encoded(reply));
}

}  // namespace tessera::server
