#pragma once

#include <cstdint>

namespace tessera {

/// Which of a sample's random numbers. Each decision along a path has its own, so that a draw that is skipped shifts
/// none (law L3), and none is used twice. Of pairs (`Sampler::two`) this is the first; the next belongs to them too.
struct Dimension {
  std::uint32_t index;

  constexpr bool operator==(const Dimension&) const = default;
};

/// Pairs that the camera draws: where on the film (through `Sampler::film` alone), and where on the lens.
inline constexpr Dimension kFilmDimension{0}, kLensDimension{2};
/// One that `Sampler::film` draws: where a replicate's grid begins.
inline constexpr Dimension kGridDimension{4};

/// What is decided at a vertex of a path. Values leave room for pairs.
enum class Decision : std::uint32_t {
  light_pick = 0,  ///< One, joined with the first of the next pair: which light.
  light = 2,       ///< A pair: where on it, once the first number has picked it.
  bsdf_lobe = 4,   ///< One: which lobe.
  bsdf = 6,        ///< A pair: the direction.
  roulette = 8,    ///< One: whether the path goes on.
  alpha = 10,      ///< One: whether the surface is there at all.
};

/// The number of a decision at vertex `vertex` of a path, the first hit being vertex 0. A surface that the path passes
/// because of its alpha is a vertex too.
constexpr Dimension dimension(std::uint32_t vertex, Decision decision) {
  constexpr std::uint32_t kOfCamera = 16, kOfVertex = 16;
  return {kOfCamera + vertex * kOfVertex + static_cast<std::uint32_t>(decision)};
}

}  // namespace tessera
