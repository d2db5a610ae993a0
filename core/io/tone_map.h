#pragma once

#include "core/math/rgb.h"

namespace tessera {

/// How radiance, which has no upper end, becomes what a display can show.
enum class ToneMap {
  none,                 ///< As it is; what is above 1 is clipped.
  khronos_pbr_neutral,  ///< Keeps colours up to 0.8 as they are and bends what is brighter.
  aces,                 ///< The look of film: contrast, and highlights that lose their colour.
};

/// How the colour of an image is shown.
struct Look {
  float exposure = 0;  ///< Stops, from -`kMostStops` to `kMostStops`: radiance counts 2^exposure times.
  ToneMap tone_map = ToneMap::none;

  bool operator==(const Look&) const = default;
};
inline constexpr float kMostStops = 64;

/// A look, ready to be applied to many pixels: linear radiance in, linear display values out, of which 0 to 1 can be
/// shown. Where there is a tone map, negative values and NaN count as black, and infinity as the greatest float. The
/// same bits on every machine. Safe to call from any thread.
///
/// Sources: "Khronos PBR Neutral Tone Mapper" (Khronos 3D Commerce, 2024). ACES: Stephen Hill's fit of the reference
/// rendering transform and the output transform for sRGB of ACES 1.0 (BakingLab, 2016), which shows a grey of 0.18 as
/// 0.106.
class Display {
 public:
  explicit Display(const Look& look);
  Rgb operator()(Rgb radiance) const;

 private:
  float scale_;
  ToneMap tone_map_;
};

}  // namespace tessera
