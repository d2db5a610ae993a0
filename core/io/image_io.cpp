#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <utility>

#include "core/io/display_curve.h"
#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"

namespace tessera {
namespace {

using Bytes = std::vector<std::byte>;
using Done = std::vector<std::uint8_t>;
using Color = std::array<std::uint8_t, 3>;
using ReadRow = decltype(Raster::read_row);

/// A plane whose pixels are looked at only where they are done; elsewhere there is `nothing`.
template <typename T>
class DonePlane {
 public:
  DonePlane(const std::vector<T>& plane, T nothing, const Done* done)
      : plane_(&plane), nothing_(nothing), done_(done) {}

  std::size_t size() const { return plane_->size(); }
  T operator[](std::size_t i) const { return !done_ || (*done_)[i] != 0 ? (*plane_)[i] : nothing_; }

 private:
  const std::vector<T>* plane_;
  T nothing_;
  const Done* done_;
};

DonePlane<Rgb> color_of(const Pixels& p, const Done* done) { return {p.color, {}, done}; }
DonePlane<float> depth_of(const Pixels& p, const Done* done) { return {p.depth, kInfinity, done}; }
DonePlane<Vec3> normal_of(const Pixels& p, const Done* done) { return {p.normal, {}, done}; }
DonePlane<std::uint32_t> ids_of(const Pixels& p, Plane plane, const Done* done) {
  return {plane == Plane::object_id ? p.object_id : p.primitive_id, kNoId, done};
}
DonePlane<float> costs_of(const Pixels& p, Plane plane, const Done* done) {
  return {plane == Plane::cost_volumes ? p.cost_volumes : p.cost_primitives, 0, done};
}

std::uint8_t unit_byte(double v) { return static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5); }

/// A hue of its own for each id, by hashing (Murmur3's finalizer).
Color id_color(std::uint32_t id) {
  if (id == kNoId) return {0, 0, 0};
  id = (id ^ (id >> 16)) * 0x85EBCA6BU;
  id = (id ^ (id >> 13)) * 0xC2B2AE35U;
  id ^= id >> 16;
  return {static_cast<std::uint8_t>(64 + id % 192), static_cast<std::uint8_t>(64 + (id >> 8) % 192),
          static_cast<std::uint8_t>(64 + (id >> 16) % 192)};
}

/// Rows of 8-bit RGB, with alpha where not all is done.
template <typename ColorOf>
ReadRow display_rows(std::size_t width, const Done* done, ColorOf color_of_pixel) {
  return [=](std::int32_t y, std::byte* row) {
    const std::size_t first = static_cast<std::size_t>(y) * width;
    for (std::size_t i = first; i < first + width; ++i) {
      for (const std::uint8_t channel : color_of_pixel(i)) *row++ = std::byte{channel};
      if (done) *row++ = (*done)[i] != 0 ? std::byte{255} : std::byte{0};
    }
  };
}

/// A plane for people to look at. Precondition: it isn't `all`.
ReadRow display_rows(const Pixels& p, Plane plane, const Done* done, bool alpha) {
  const auto rows = [&](auto color_of_pixel) {
    return display_rows(static_cast<std::size_t>(p.rect.width()), alpha ? done : nullptr, color_of_pixel);
  };
  switch (plane) {
    case Plane::color:
    case Plane::all:
      break;
    case Plane::depth: {
      const DonePlane<float> depth = depth_of(p, done);
      float nearest = kInfinity, farthest = 0;
      for (std::size_t i = 0; i < depth.size(); ++i)
        if (const float d = depth[i]; std::isfinite(d))
          nearest = std::min(nearest, d), farthest = std::max(farthest, d);
      const double range = std::max(double{farthest} - nearest, 1e-30);
      return rows([=](std::size_t i) {
        const float d = depth[i];
        const std::uint8_t v = std::isfinite(d) ? unit_byte(1 - (d - nearest) / range * 0.9) : std::uint8_t{0};
        return Color{v, v, v};
      });
    }
    case Plane::normal:
      return rows([normal = normal_of(p, done)](std::size_t i) {
        const Vec3 n = normal[i];
        return Color{unit_byte(n.x / 2 + 0.5), unit_byte(n.y / 2 + 0.5), unit_byte(n.z / 2 + 0.5)};
      });
    case Plane::primitive_id:
    case Plane::object_id:
      return rows([ids = ids_of(p, plane, done)](std::size_t i) { return id_color(ids[i]); });
    case Plane::cost_volumes:
    case Plane::cost_primitives: {
      const DonePlane<float> costs = costs_of(p, plane, done);
      float greatest = 0;
      for (std::size_t i = 0; i < costs.size(); ++i) greatest = std::max(greatest, costs[i]);
      const double most = std::max(double{greatest}, 1e-30);
      return rows([=](std::size_t i) { return heat_color(costs[i] / most); });
    }
  }
  return rows([color = color_of(p, done)](std::size_t i) {
    const Rgb c = color[i];
    return Color{display_byte(c.r), display_byte(c.g), display_byte(c.b)};
  });
}

/// Planes of 32-bit values, to be put together pixel by pixel.
class Interleaved {
 public:
  template <typename PlaneOf>
  void add(std::vector<std::string> names, ChannelType type, PlaneOf plane) {
    static_assert(sizeof(plane[0]) % 4 == 0);
    const std::size_t offset = 4 * channels_.size();
    for (std::string& name : names) channels_.push_back({std::move(name), type});
    writers_.push_back([=](std::size_t first, std::size_t count, std::byte* row, std::size_t stride) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto value = plane[first + i];
        std::memcpy(row + i * stride + offset, &value, sizeof value);
      }
    });
  }

  Raster raster(const PixelRect& rect) && {
    const auto width = static_cast<std::size_t>(rect.width());
    Raster raster{rect.width(), rect.height(), channels_, {}};
    raster.read_row = [writers = std::move(writers_), width, stride = 4 * channels_.size()](std::int32_t y,
                                                                                            std::byte* row) {
      for (const auto& write : writers) write(static_cast<std::size_t>(y) * width, width, row, stride);
    };
    return raster;
  }

 private:
  std::vector<Channel> channels_;
  std::vector<std::function<void(std::size_t first, std::size_t count, std::byte* row, std::size_t stride)>> writers_;
};

/// A plane's values, each made into another one.
template <typename Values, typename Change>
struct Changed {
  Values values;
  Change change;
  auto operator[](std::size_t i) const { return change(values[i]); }
};
template <typename Values, typename Change>
Changed(Values, Change) -> Changed<Values, Change>;

bool has(const Pixels& p, Plane plane) {
  switch (plane) {
    case Plane::color:
    case Plane::all:
      return true;
    case Plane::depth:
      return !p.depth.empty();
    case Plane::normal:
      return !p.normal.empty();
    case Plane::primitive_id:
      return !p.primitive_id.empty();
    case Plane::object_id:
      return !p.object_id.empty();
    case Plane::cost_volumes:
      return !p.cost_volumes.empty();
    case Plane::cost_primitives:
      return !p.cost_primitives.empty();
  }
  return false;
}

Raster display_raster(const Pixels& p, Plane plane, const Done* done, bool alpha) {
  Raster raster{p.rect.width(), p.rect.height(), {}, display_rows(p, plane, done, alpha)};
  for (const char* name : {"R", "G", "B"}) raster.channels.push_back({name, ChannelType::byte});
  if (done && alpha) raster.channels.push_back({"A", ChannelType::byte});
  return raster;
}

Raster exact_raster(const Pixels& p, Plane plane, const Done* done) {
  const auto wanted = [&](Plane one) { return (plane == one || plane == Plane::all) && has(p, one); };
  Interleaved planes;
  if (wanted(Plane::color)) planes.add({"R", "G", "B"}, ChannelType::real, color_of(p, done));
  if (done)
    planes.add({"A"}, ChannelType::real, Changed{DonePlane<std::uint8_t>(*done, 0, nullptr), [](std::uint8_t d) {
                                                   return d != 0 ? 1.0F : 0.0F;
                                                 }});
  if (wanted(Plane::depth)) planes.add({"Z"}, ChannelType::real, depth_of(p, done));
  if (wanted(Plane::normal)) planes.add({"N.X", "N.Y", "N.Z"}, ChannelType::real, normal_of(p, done));
  const auto add_ids = [&](const char* name, Plane ids) {
    if (wanted(ids)) planes.add({name}, ChannelType::id, ids_of(p, ids, done));
  };
  add_ids("primitiveId", Plane::primitive_id);
  add_ids("objectId", Plane::object_id);
  const auto add_costs = [&](const char* name, Plane costs) {
    if (wanted(costs)) planes.add({name}, ChannelType::real, costs_of(p, costs, done));
  };
  add_costs("cost.volumes", Plane::cost_volumes);
  add_costs("cost.primitives", Plane::cost_primitives);
  return std::move(planes).raster(p.rect);
}

/// RGBE's exponent goes to 127: beyond its greatest number, writers store something tiny.
float in_rgbe(float v) { return std::min(v, 0x1.fffffep126F); }

Raster rgbe_raster(const Pixels& p, Plane plane, const Done* done) {
  Interleaved planes;
  if (plane == Plane::color)
    planes.add({"R", "G", "B"}, ChannelType::real, Changed{color_of(p, done), [](Rgb c) {
                                                             return Rgb{in_rgbe(c.r), in_rgbe(c.g), in_rgbe(c.b)};
                                                           }});
  else
    planes.add({"R", "G", "B"}, ChannelType::real, Changed{costs_of(p, plane, done), [](float v) {
                                                             return Rgb{in_rgbe(v), in_rgbe(v), in_rgbe(v)};
                                                           }});
  return std::move(planes).raster(p.rect);
}

std::set<Aov> recorded_by(const Pixels& p) {
  std::set<Aov> recorded;
  const auto note = [&](Plane plane, Aov aov) {
    if (has(p, plane)) recorded.insert(aov);
  };
  note(Plane::depth, Aov::depth);
  note(Plane::normal, Aov::normal);
  note(Plane::primitive_id, Aov::primitive_id);
  note(Plane::object_id, Aov::object_id);
  note(Plane::cost_volumes, Aov::cost_volumes);
  note(Plane::cost_primitives, Aov::cost_primitives);
  return recorded;
}

bool can_hold_values(PixelValues values, Plane plane) {
  switch (values) {
    case PixelValues::display:
      return plane != Plane::all;
    case PixelValues::rgbe:
      return plane == Plane::color || plane == Plane::cost_volumes || plane == Plane::cost_primitives;
    case PixelValues::exact:
      return true;
  }
  return false;
}

}  // namespace

bool can_hold(ImageFormat format, Plane plane, std::uint32_t width, std::uint32_t height,
              const std::set<Aov>& recorded) {
  const FormatLimits& limits = limits_of(format);
  // Of one plane no more than what colour takes, with alpha.
  const std::uint64_t pixel =
      Film::memory_bytes(1, 1, plane == Plane::all ? recorded : std::set<Aov>{}) + sizeof(float);
  return can_hold_values(limits.values, plane) && width >= 1 && width <= limits.max_width && height >= 1 &&
         height <= limits.max_height && width <= limits.max_row_bytes / pixel;
}

std::optional<Bytes> encode(const Pixels& pixels, Plane plane, const Encoding& encoding, const Done* done,
                            const std::stop_token& stop) {
  const auto width = static_cast<std::uint32_t>(pixels.rect.width());
  const auto height = static_cast<std::uint32_t>(pixels.rect.height());
  if (!has(pixels, plane) || !can_hold(encoding.format, plane, width, height, recorded_by(pixels))) return std::nullopt;
  const bool alpha = limits_of(encoding.format).alpha;
  switch (encoding.format) {
    case ImageFormat::png:
      return write_png(display_raster(pixels, plane, done, alpha), stop);
    case ImageFormat::jpeg:
      return write_jpeg(display_raster(pixels, plane, done, alpha), encoding.jpeg, stop);
    case ImageFormat::exr:
      return write_with_oiio(encoding.format, exact_raster(pixels, plane, done), stop);
    case ImageFormat::hdr:
      return write_with_oiio(encoding.format, rgbe_raster(pixels, plane, done), stop);
  }
  return std::nullopt;
}

}  // namespace tessera
