#include "core/scene/film_plane.h"

#include "core/math/portable.h"

namespace tessera {

FilmPlane film_plane(const PerspectiveCamera& camera, std::uint32_t width, std::uint32_t height) {
  if (const auto& given = camera.intrinsics) return {given->cx, given->cy, 1.0 / given->fx, 1.0 / given->fy};
  const double pixel = 2 * portable_tan(camera.vertical_fov / 2.0) / height;
  return {width / 2.0, height / 2.0, pixel, pixel};
}

FilmPlane film_plane(const OrthographicCamera& camera, std::uint32_t width, std::uint32_t height) {
  const double pixel = double{camera.height} / height;
  return {width / 2.0, height / 2.0, pixel, pixel};
}

}  // namespace tessera
