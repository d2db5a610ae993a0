#pragma once

#include <cstdint>
#include <string>

#include "proto/import/import.h"
#include "server/isolation/confinement.h"
#include "server/isolation/worker.h"

namespace tessera::server {

enum class ReadKind : std::uint32_t { model, environment, image };

/// What a worker is asked to read, beside the files that come with it.
struct ReadRequest {
  ReadKind kind{};
  Allowance allowance = {};
  std::string name = {};                ///< How messages call it; of an image, what tells its format.
  std::uint64_t most_bytes = 0;         ///< That an environment, or an image, may take.
  std::uint64_t offset = 0, bytes = 0;  ///< Where an image lies in its file.
  proto::FileFormat format{};           ///< Of a model,
  proto::ImportOptions options = {};    ///< and what is to be made of it.
};

/// The files of a request, in their order. The outcome goes into shared memory: what `FlatWriter` writes, or an image's
/// texels; those of large images into another one.
enum RequestFile : std::size_t { kInput, kOutcome, kLargeImages };
inline constexpr std::size_t kLargeImageAlignment = 1 << 16;

/// What a worker says when it is done.
struct ReadReply {
  bool wants_preparation = false;    ///< It takes the image library, which a worker that isn't prepared can't load.
  bool is_out_of_memory = false;     ///< Of the system's,
  bool is_beyond_allowance = false;  ///< or of what it was allowed.
  std::string missing_library = {};  ///< Why the image library can't be loaded.
  std::uint32_t width = 0, height = 0, channels = 0, channel_bytes = 0;  ///< Of an image that was decoded.
  std::string problem = {};                                              ///< What is wrong with an image.
};

std::string encoded(const ReadRequest& request);
std::string encoded(const ReadReply& reply);
/// Throw `NotFlat`.
ReadRequest read_request(std::string_view body);
ReadReply read_reply(std::string_view body);

/// A worker's question for a file that the model names, and the answer: which of those that were found it is, the first
/// being 1, and 0 for none. A file that is found comes with the answer.
std::string encoded_number(std::uint32_t number);
std::uint32_t decoded_number(std::string_view body);

/// Does what a `ReadRequest` asks for, within its allowance: the `Work` of workers that read.
void read_in_worker(Worker& worker, Message request);

}  // namespace tessera::server
