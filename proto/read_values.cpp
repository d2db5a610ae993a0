#include "proto/read_values.h"

#include <numbers>

#include "core/geometry/triangle_mesh.h"
#include "core/scene/light.h"

namespace tessera::proto {

const NumberRange kCoordinate{-kLargestCoordinate, kLargestCoordinate, false, "a number from -1e18 to 1e18"};
const NumberRange kLightChannel{0, kLargestLight, false, "a number from 0 to 1e18"};

bool read(std::optional<JsonCursor> value, Vec3& out, const NumberRange& range) {
  if (!value) return true;
  if (value->kind() != JsonKind::array || value->size() != 3) return value->expected("an array of 3 numbers");
  Vec3 numbers;
  int axis = 0;
  bool good = true;
  for (const JsonCursor& element : value->elements()) good &= read(element, numbers[axis++], range);
  if (good) out = numbers;
  return good;
}

bool read_color(std::optional<JsonCursor> value, Rgb& out, const NumberRange& range) {
  Vec3 numbers{out.r, out.g, out.b};
  if (!read(value, numbers, range)) return false;
  out = {numbers.x, numbers.y, numbers.z};
  return true;
}

float radians(float degrees) { return static_cast<float>(degrees * std::numbers::pi / 180); }

bool read_schema_name(std::optional<JsonCursor> value) {
  return !value || value->kind() == JsonKind::string || value->expected("the URI of a schema, as a string");
}

bool read_direction(std::optional<JsonCursor> value, UnitVec3& out) {
  Vec3 numbers = out;
  if (!value || !read(value, numbers, kAnyNumber)) return !value;
  const auto direction = UnitVec3::normalize(numbers);
  if (!direction) return value->error("A direction can't be [0, 0, 0]; give it any length but zero.");
  out = *direction;
  return true;
}

}  // namespace tessera::proto
