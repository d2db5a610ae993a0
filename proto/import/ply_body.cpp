#include "proto/import/ply_body.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include "proto/import/broken_file.h"
#include "proto/import/numbers.h"

namespace tessera::proto {
namespace {

float narrowed(double value) {
  if (std::abs(value) > std::numeric_limits<float>::max())
    return std::copysign(INFINITY, static_cast<float>(std::copysign(1.0, value)));
  return static_cast<float>(value);
}

}  // namespace

void fail_short(std::string_view file_name, std::uint64_t missing) {
  throw BrokenFile{{{file_place(file_name, 0), "The file is cut off: at least " + std::to_string(missing) +
                                                   (missing == 1 ? " byte is" : " bytes are") + " missing"}}};
}

void PlyTextBody::fail(const std::string& expected) {
  const std::string_view word = cursor_.next();
  throw BrokenFile{{{file_place(file_name_, cursor_.line()),
                     word.empty() ? "The file ends where a number is expected"
                                  : expected + " is expected here, not \"" + std::string(word.substr(0, 40)) + '"'}}};
}

float PlyTextBody::number(PlyScalar) {
  if (const std::optional<float> value = next_float(cursor_)) return *value;
  fail("A number");
}

std::int64_t PlyTextBody::integer(PlyScalar) {
  if (const std::optional<std::int64_t> value = next_integer(cursor_)) return *value;
  fail("A whole number");
}

void PlyTextBody::skip(PlyScalar, std::uint64_t times) {
  for (std::uint64_t i = 0; i < times; ++i)
    if (cursor_.next().empty()) fail("A number");
}

PlyBinaryBody::PlyBinaryBody(std::string_view bytes, const PlyHeader& header, std::string_view file_name)
    : at_(bytes.data() + header.body),
      end_(bytes.data() + bytes.size()),
      swap_((header.encoding == PlyEncoding::big_endian) != (std::endian::native == std::endian::big)),
      file_name_(file_name) {}

void PlyBinaryBody::need(PlyScalar type, std::uint64_t times) const {
  // A list's length is below 2^32: no overflow.
  const std::uint64_t bytes = size_of(type) * times;
  if (bytes > bytes_left()) fail_short(file_name_, bytes - bytes_left() + expected_after_);
}

template <typename T>
T PlyBinaryBody::load() {
  char raw[sizeof(T)];
  std::memcpy(raw, at_, sizeof(T));
  at_ += sizeof(T);
  if (swap_) std::reverse(raw, raw + sizeof(T));
  return std::bit_cast<T>(raw);
}

float PlyBinaryBody::number(PlyScalar type) {
  need(type, 1);
  if (type == PlyScalar::float32) return load<float>();
  if (type == PlyScalar::float64) return narrowed(load<double>());
  return static_cast<float>(integer(type));
}

std::int64_t PlyBinaryBody::integer(PlyScalar type) {
  need(type, 1);
  switch (type) {
    case PlyScalar::int8:
      return load<std::int8_t>();
    case PlyScalar::uint8:
      return load<std::uint8_t>();
    case PlyScalar::int16:
      return load<std::int16_t>();
    case PlyScalar::uint16:
      return load<std::uint16_t>();
    case PlyScalar::int32:
      return load<std::int32_t>();
    case PlyScalar::uint32:
      return load<std::uint32_t>();
    case PlyScalar::float32:
    case PlyScalar::float64:
      break;  // The header's check lets none through.
  }
  std::abort();
}

void PlyBinaryBody::skip(PlyScalar type, std::uint64_t times) {
  need(type, times);
  at_ += size_of(type) * times;
}

}  // namespace tessera::proto
