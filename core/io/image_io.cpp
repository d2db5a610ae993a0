#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <variant>

#include "core/io/display_curve.h"
#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"
#include "core/math/rounding.h"

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

/// Calls `use` with the values of a plane, of whatever type they are, and how they look. Precondition: the plane is
/// one, not `kAllPlanes`, and recorded.
template <typename Use>
auto with_plane(const Pixels& p, Plane plane, const Done* done, Use use) {
  if (!plane.aov) return use(DonePlane<Rgb>(p.color, {}, done), AovLook::color);
  const AovEntry& row = aov_entry(*plane.aov);
  return std::visit(
      [&]<typename T>(const std::vector<T>& values) {
        return use(DonePlane<T>(values, std::get<T>(row.empty), done), row.look);
      },
      p.values(*plane.aov));
}

double scalar(float v) { return v; }
double scalar(std::uint32_t v) { return v; }
double scalar(Rgb c) { return (double{c.r} + c.g + c.b) / 3; }
double scalar(Vec3 v) { return (double{v.x} + v.y + v.z) / 3; }

std::array<float, 3> triple(float v) { return {v, v, v}; }
std::array<float, 3> triple(std::uint32_t v) { return triple(static_cast<float>(v)); }
std::array<float, 3> triple(Rgb c) { return {c.r, c.g, c.b}; }
std::array<float, 3> triple(Vec3 v) { return {v.x, v.y, v.z}; }

/// The finite values among some.
struct Extent {
  float least = kInfinity, greatest = -kInfinity;

  void add(float v) {
    if (std::isfinite(v)) least = std::min(least, v), greatest = std::max(greatest, v);
  }
  /// Where `v` lies: 0 for the least, 1 for the greatest.
  double share(float v) const { return (double{v} - least) / std::max(double{greatest} - least, 1e-30); }
};

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

template <typename Values>
std::function<Color(std::size_t)> color_by_nearness(const Values& depth) {
  Extent extent;
  for (std::size_t i = 0; i < depth.size(); ++i) extent.add(static_cast<float>(scalar(depth[i])));
  return [=](std::size_t i) {
    const auto d = static_cast<float>(scalar(depth[i]));
    const std::uint8_t v = std::isfinite(d) ? unit_byte(1 - extent.share(d) * 0.9) : std::uint8_t{0};
    return Color{v, v, v};
  };
}

template <typename Values>
std::function<Color(std::size_t)> color_by_extent(const Values& values) {
  std::array<Extent, 3> extents;
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) extents[c].add(triple(values[i])[c]);
  return [=](std::size_t i) {
    Color color;
    for (std::size_t c = 0; c < 3; ++c) color[c] = unit_byte(extents[c].share(triple(values[i])[c]));
    return color;
  };
}

template <typename Values>
std::function<Color(std::size_t)> color_by_heat(const Values& values) {
  double greatest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) greatest = std::max(greatest, scalar(values[i]));
  const double most = std::max(greatest, 1e-30);
  return [=](std::size_t i) { return heat_color(scalar(values[i]) / most); };
}

/// A plane for people to look at. Precondition: it isn't `kAllPlanes`.
ReadRow display_rows(const Pixels& p, Plane plane, const Done* done, bool alpha) {
  const auto rows = [&](auto color_of_pixel) {
    return display_rows(static_cast<std::size_t>(p.rect.width()), alpha ? done : nullptr, color_of_pixel);
  };
  const auto bytes = [&](auto values, auto byte_of) {
    return rows([=](std::size_t i) {
      const std::array<float, 3> v = triple(values[i]);
      return Color{byte_of(v[0]), byte_of(v[1]), byte_of(v[2])};
    });
  };
  return with_plane(p, plane, done, [&](auto values, AovLook look) -> ReadRow {
    switch (look) {
      case AovLook::color:
        return bytes(values, display_byte);
      case AovLook::grey:
        return bytes(values, [](float v) { return unit_byte(v); });
      case AovLook::direction:
        return bytes(values, [](float v) { return unit_byte(v / 2 + 0.5); });
      case AovLook::nearness:
        return rows(color_by_nearness(values));
      case AovLook::extent:
        return rows(color_by_extent(values));
      case AovLook::heat:
        return rows(color_by_heat(values));
      case AovLook::hue:
        break;
    }
    return rows([=](std::size_t i) { return id_color(static_cast<std::uint32_t>(scalar(values[i]))); });
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

bool has(const Pixels& p, Plane plane) { return !plane.aov || p.has(*plane.aov); }

Raster display_raster(const Pixels& p, Plane plane, const Done* done, bool alpha) {
  Raster raster{p.rect.width(), p.rect.height(), {}, display_rows(p, plane, done, alpha)};
  for (const char* name : {"R", "G", "B"}) raster.channels.push_back({name, ChannelType::byte});
  if (done && alpha) raster.channels.push_back({"A", ChannelType::byte});
  return raster;
}

Raster exact_raster(const Pixels& p, Plane plane, const Done* done) {
  const auto wanted = [&](Aov aov) { return (plane == Plane{aov} || plane == kAllPlanes) && p.has(aov); };
  Interleaved planes;
  if (!plane.aov) planes.add({"R", "G", "B"}, ChannelType::real, DonePlane<Rgb>(p.color, {}, done));
  // What isn't done is transparent in the alpha that a job records, too.
  if (done && !wanted(Aov::alpha))
    planes.add({"A"}, ChannelType::real, Changed{DonePlane<std::uint8_t>(*done, 0, nullptr), [](std::uint8_t d) {
                                                   return d != 0 ? 1.0F : 0.0F;
                                                 }});
  for (const AovEntry& row : aov_table()) {
    if (!wanted(row.aov)) continue;
    std::vector<std::string> names;
    for (const std::string_view name : row.channels)
      if (!name.empty()) names.emplace_back(name);
    const auto type = std::holds_alternative<std::uint32_t>(row.empty) ? ChannelType::id : ChannelType::real;
    with_plane(p, Plane{row.aov}, done, [&](auto values, AovLook) { planes.add(names, type, values); });
  }
  return std::move(planes).raster(p.rect);
}

/// RGBE's exponent goes to 127: beyond its greatest number, writers store something tiny.
float in_rgbe(float v) { return std::min(v, 0x1.fffffep126F); }

Raster rgbe_raster(const Pixels& p, Plane plane, const Done* done) {
  Interleaved planes;
  with_plane(p, plane, done, [&](auto values, AovLook) {
    planes.add({"R", "G", "B"}, ChannelType::real, Changed{values, [](auto value) {
                                                             const auto [r, g, b] = triple(value);
                                                             return Rgb{in_rgbe(r), in_rgbe(g), in_rgbe(b)};
                                                           }});
  });
  return std::move(planes).raster(p.rect);
}

/// What RGBE can hold is finite, and neither negative nor in need of being exact.
bool fits_rgbe(Plane plane) {
  if (plane == kAllPlanes) return false;
  const AovLook look = plane.aov ? aov_entry(*plane.aov).look : AovLook::color;
  return look == AovLook::color || look == AovLook::grey || look == AovLook::heat;
}

bool can_hold_values(PixelValues values, Plane plane) {
  switch (values) {
    case PixelValues::display:
      return plane != kAllPlanes;
    case PixelValues::rgbe:
      return fits_rgbe(plane);
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
      Film::memory_bytes(1, 1, plane == kAllPlanes ? recorded : std::set<Aov>{}) + sizeof(float);
  return can_hold_values(limits.values, plane) && width >= 1 && width <= limits.max_width && height >= 1 &&
         height <= limits.max_height && width <= limits.max_row_bytes / pixel;
}

std::optional<Bytes> encode(const Pixels& pixels, Plane plane, const Encoding& encoding, const Done* done,
                            const std::stop_token& stop) {
  const auto width = static_cast<std::uint32_t>(pixels.rect.width());
  const auto height = static_cast<std::uint32_t>(pixels.rect.height());
  if (!has(pixels, plane) || !can_hold(encoding.format, plane, width, height, pixels.aovs())) return std::nullopt;
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
