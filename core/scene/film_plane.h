#pragma once

#include <cstdint>

#include "core/scene/camera.h"

namespace tessera {

/// A camera's image, in doubles, row 0 being the top: where its axis meets it, in pixels from its top left corner; and
/// the sides of its pixels in metres, a perspective camera's on the plane at depth 1.
struct FilmPlane {
  double axis_x, axis_y, pixel_x, pixel_y;
};
FilmPlane film_plane(const PerspectiveCamera& camera, std::uint32_t width, std::uint32_t height);
FilmPlane film_plane(const OrthographicCamera& camera, std::uint32_t width, std::uint32_t height);

}  // namespace tessera
