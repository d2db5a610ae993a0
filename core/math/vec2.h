#pragma once

namespace tessera {

/// Two components; a point of the unit square, of a disk, of an image, as its name says.
struct Vec2 {
  float x{}, y{};

  constexpr bool operator==(const Vec2&) const = default;
};

}  // namespace tessera
