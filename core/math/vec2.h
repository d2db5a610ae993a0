#pragma once

namespace tessera {

/// Two components: a position on a film, a lens or a surface, or two numbers of a sample.
struct Vec2 {
  float x{}, y{};

  constexpr bool operator==(const Vec2&) const = default;
};

}  // namespace tessera
