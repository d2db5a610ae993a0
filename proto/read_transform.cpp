#include "proto/read_transform.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/math/portable.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

using Rows = std::array<double, 12>;

/// Whether the element may stand there in a 4x4 matrix: its last row is fixed.
bool is_affine(const JsonCursor& element, double number, std::size_t position) {
  if (position < 12 || number == (position == 15 ? 1 : 0)) return true;
  return element.error("The last row of a 4x4 matrix must be 0, 0, 0, 1; numbers stand row by row.");
}

bool read_rows(JsonCursor value, Rows& rows) {
  if (value.size() != 12 && value.size() != 16) {
    return value.expected(
        "12 or 16 numbers (a row-major 3x4 or 4x4 matrix), or an object with translate, rotate and scale");
  }
  std::array<double, 16> numbers{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  bool good = true;
  std::size_t i = 0;
  for (const JsonCursor& element : value.elements()) {
    good &= read(element, numbers[i]) && is_affine(element, numbers[i], i);
    ++i;
  }
  if (!good) return false;
  std::copy_n(numbers.begin(), rows.size(), rows.begin());
  return true;
}

struct SineCosine {
  double sine, cosine;
};

/// Exact at multiples of 90°, unlike functions of the angle in radians.
SineCosine sine_cosine(double degrees) {
  int quadrant = 0;
  const double rest = std::remquo(degrees, 90, &quadrant) * std::numbers::pi / 180;
  const double s = portable_sin(rest), c = portable_cos(rest);
  switch (quadrant & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// Rodrigues' rotation, counter-clockwise seen against the axis.
std::array<Vec3d, 3> rotation_rows(Vec3d a, double degrees) {
  const auto [s, c] = sine_cosine(degrees);
  const double k = 1 - c;
  return {Vec3d{c + a.x * a.x * k, a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s},
          Vec3d{a.y * a.x * k + a.z * s, c + a.y * a.y * k, a.y * a.z * k - a.x * s},
          Vec3d{a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k}};
}

bool read_rotation(JsonCursor value, std::array<Vec3d, 3>& rows) {
  JsonFields fields(value, "a rotation");
  const auto axis_field = fields.required("axis"), degrees_field = fields.required("degrees");
  UnitVec3 axis = UnitVec3::z();
  double degrees = 0;
  bool good = axis_field && read_direction(axis_field, axis);
  good &= degrees_field && read(degrees_field, degrees);
  fields.refuse_unknown();
  if (good) rows = rotation_rows(to_double(axis), degrees);
  return good;
}

bool read_scale(JsonCursor value, Vec3& scale) {
  if (value.kind() == JsonKind::array) return read(value, scale, kAnyNumber);
  float uniform = 1;
  if (!value.is_number()) return value.expected("a number or an array of 3 numbers");
  if (!read(value, uniform)) return false;
  scale = {uniform, uniform, uniform};
  return true;
}

bool read_steps(JsonCursor value, Rows& rows) {
  JsonFields fields(value, "a transform");
  Vec3 translate, scale{1, 1, 1};
  std::array<Vec3d, 3> rotation{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  bool good = read(fields.optional("translate"), translate, kCoordinate);
  if (const auto rotate = fields.optional("rotate")) good &= read_rotation(*rotate, rotation);
  if (const auto field = fields.optional("scale")) good &= read_scale(*field, scale);
  fields.refuse_unknown();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rows[i * 4 + j] = rotation[i][j] * scale[j];
    rows[i * 4 + 3] = translate[i];
  }
  return good;
}

}  // namespace

std::optional<Transform> read_transform(JsonCursor value) {
  Rows rows{};
  const bool good = value.kind() == JsonKind::array ? read_rows(value, rows) : read_steps(value, rows);
  if (!good) return std::nullopt;
  const auto transform = Transform::from_rows(rows);
  if (!transform) {
    value.error(
        "The transform is singular (it flattens what it places) or too extreme for single precision; every scale must "
        "differ from 0.");
  }
  return transform;
}

}  // namespace tessera::proto
