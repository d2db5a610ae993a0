#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/wire/problem.h"

namespace tessera::server {

/// Takes the chunked coding off a body while it comes in (RFC 9112, 7.1). Extensions of chunks and trailers are checked
/// and dropped; it keeps no more than one line of them.
class ChunkedBody {
 public:
  static constexpr std::size_t kMostExtensions = 16 << 10;  ///< In bytes, of all chunks of a body together;
  static constexpr std::size_t kMostTrailers = 16 << 10;    ///< and of all trailers.

  /// Takes bytes off the front of `received` up to the next piece of data, and gives that: a view of them. Empty when
  /// more has to come first, the end is reached, or something is wrong.
  std::string_view next(std::string_view& received);

  /// The end of the body has been taken.
  bool is_complete() const { return part_ == Part::end; }
  const std::optional<proto::Problem>& problem() const { return problem_; }

 private:
  enum class Part { size, data, after_data, trailers, end };

  /// Takes bytes into `line_`; whether it is complete.
  bool take_line(std::string_view& received, std::size_t most);
  void read_line();
  void read_size();

  Part part_ = Part::size;
  std::string line_;             ///< Without its end, once it is complete.
  std::uint64_t data_left_ = 0;  ///< Of the chunk at hand.
  std::size_t extension_bytes_ = 0, trailer_bytes_ = 0;
  std::optional<proto::Problem> problem_;
};

}  // namespace tessera::server
