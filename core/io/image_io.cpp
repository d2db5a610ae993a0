#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/io/display_curve.h"
#include "core/io/half.h"
#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"
#include "core/io/tiff_file.h"
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

/// How much of each pixel is there: what isn't done is not, and of a transparent image what its alpha says.
class Coverage {
 public:
  Coverage(const std::vector<float>* alpha, const Done* done) : alpha_(alpha), done_(done) {}

  /// Whether anything may be transparent.
  bool is_partial() const { return alpha_ || done_; }
  float operator[](std::size_t i) const { return done_ && (*done_)[i] == 0 ? 0 : alpha_ ? (*alpha_)[i] : 1; }

 private:
  const std::vector<float>* alpha_;
  const Done* done_;
};

Coverage coverage_of(const Pixels& p, Plane plane, const Done* done, bool transparent) {
  return {transparent && !plane.aov ? &p.plane<float>(Aov::alpha) : nullptr, done};
}

/// Rows of 8-bit RGB, with alpha where that is asked for.
template <typename ColorOf>
ReadRow display_rows(std::size_t width, std::optional<Coverage> alpha, ColorOf color_of_pixel) {
  return [=](std::int32_t y, std::byte* row) {
    const std::size_t first = static_cast<std::size_t>(y) * width;
    for (std::size_t i = first; i < first + width; ++i) {
      for (const std::uint8_t channel : color_of_pixel(i)) *row++ = std::byte{channel};
      if (alpha) *row++ = std::byte{unit_byte((*alpha)[i])};
    }
  };
}

/// The colour of what covers a pixel to a part.
Rgb uncovered(Rgb color, float coverage) {
  if (!(coverage > 0 && coverage < 1)) return color;
  return {color.r / coverage, color.g / coverage, color.b / coverage};
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

/// A colour as it is shown, over what shows through.
class Composite {
 public:
  Composite(Display display, Coverage coverage, Rgb background)
      : display_(display), coverage_(coverage), background_(background) {}

  Rgb operator()(Rgb color, std::size_t i) const {
    const float part = std::clamp(coverage_[i], 0.0F, 1.0F);
    const Rgb shown = display_(uncovered(color, part));
    const auto over = [&](float above, float below) {
      return part > 0 ? std::clamp(above, 0.0F, 1.0F) * part + below * (1 - part) : below;
    };
    return {over(shown.r, background_.r), over(shown.g, background_.g), over(shown.b, background_.b)};
  }

 private:
  Display display_;
  Coverage coverage_;
  Rgb background_;
};

/// A plane for people to look at. Precondition: it isn't `kAllPlanes`.
ReadRow display_rows(const Pixels& p, Plane plane, const Done* done, const Look& look_of_color,
                     std::optional<Coverage> alpha) {
  const auto rows = [&](auto color_of_pixel) {
    return display_rows(static_cast<std::size_t>(p.rect.width()), alpha, color_of_pixel);
  };
  if (!plane.aov)
    return rows([=, color = DonePlane<Rgb>(p.color, {}, done), display = Display(look_of_color)](std::size_t i) {
      const Rgb shown = display(alpha ? uncovered(color[i], (*alpha)[i]) : color[i]);
      return Color{display_byte(shown.r), display_byte(shown.g), display_byte(shown.b)};
    });
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
      case AovLook::linear:
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

/// A pixel's value as it is, in 32 bits a channel, or whole numbers of 16.
template <typename T>
struct AsIs {
  static constexpr ChannelType kType = std::is_same_v<T, std::uint16_t> ? ChannelType::word
                                       : std::is_integral_v<T>          ? ChannelType::id
                                                                        : ChannelType::real;
  void operator()(const T& value, std::byte* to) const { std::memcpy(to, &value, sizeof value); }
};

/// The floats of a pixel's value in 16 bits each.
template <typename T>
struct Halved {
  static constexpr ChannelType kType = ChannelType::half;
  void operator()(const T& value, std::byte* to) const {
    std::array<float, sizeof(T) / sizeof(float)> floats;
    std::memcpy(floats.data(), &value, sizeof value);
    for (const float v : floats) {
      const std::uint16_t bits = half_bits(v);
      std::memcpy(to, &bits, sizeof bits);
      to += sizeof bits;
    }
  }
};

/// Planes of values, to be put together pixel by pixel.
class Interleaved {
 public:
  explicit Interleaved(Precision precision) : precision_(precision) {}

  template <typename PlaneOf>
  void add(std::vector<std::string> names, PlaneOf plane) {
    using Value = std::decay_t<decltype(plane[0])>;
    static_assert(sizeof(Value) % 4 == 0 || sizeof(Value) == 2);
    if constexpr (!std::is_integral_v<Value>)
      if (precision_ == Precision::half) return add(std::move(names), plane, Halved<Value>());
    add(std::move(names), plane, AsIs<Value>());
  }

  Raster raster(const PixelRect& rect) && {
    const auto width = static_cast<std::size_t>(rect.width());
    Raster raster{rect.width(), rect.height(), channels_, {}};
    raster.read_row = [writers = std::move(writers_), width, stride = pixel_bytes_](std::int32_t y, std::byte* row) {
      for (const auto& write : writers) write(static_cast<std::size_t>(y) * width, width, row, stride);
    };
    return raster;
  }

 private:
  template <typename PlaneOf, typename Write>
  void add(std::vector<std::string> names, PlaneOf plane, Write write_value) {
    const std::size_t offset = pixel_bytes_;
    pixel_bytes_ += names.size() * bytes_of(Write::kType);
    for (std::string& name : names) channels_.push_back({std::move(name), Write::kType});
    writers_.push_back([=](std::size_t first, std::size_t count, std::byte* row, std::size_t stride) {
      for (std::size_t i = 0; i < count; ++i) write_value(plane[first + i], row + i * stride + offset);
    });
  }

  Precision precision_;
  std::size_t pixel_bytes_ = 0;
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

Raster composite_raster(const Pixels& p, const Done* done, const Encoding& encoding) {
  const Composite composite(Display(encoding.look), coverage_of(p, kColorPlane, done, encoding.transparent),
                            *encoding.background);
  const auto color_of = [=, color = DonePlane<Rgb>(p.color, {}, done)](std::size_t i) {
    const Rgb shown = composite(color[i], i);
    return Color{display_byte(shown.r), display_byte(shown.g), display_byte(shown.b)};
  };
  Raster raster{p.rect.width(),
                p.rect.height(),
                {},
                display_rows(static_cast<std::size_t>(p.rect.width()), std::nullopt, color_of)};
  for (const char* name : {"R", "G", "B"}) raster.channels.push_back({name, ChannelType::byte});
  return raster;
}

Raster display_raster(const Pixels& p, Plane plane, const Done* done, const Encoding& encoding) {
  if (!plane.aov && encoding.background) return composite_raster(p, done, encoding);
  std::optional<Coverage> alpha;
  if (limits_of(encoding.format).alpha) alpha = coverage_of(p, plane, done, encoding.transparent);
  if (alpha && !alpha->is_partial() && !encoding.has_alpha) alpha.reset();
  Raster raster{p.rect.width(), p.rect.height(), {}, display_rows(p, plane, done, encoding.look, alpha)};
  for (const char* name : {"R", "G", "B"}) raster.channels.push_back({name, ChannelType::byte});
  if (alpha) raster.channels.push_back({"A", ChannelType::byte});
  return raster;
}

Raster exact_raster(const Pixels& p, Plane plane, const Done* done, const Encoding& encoding) {
  const auto wanted = [&](Aov aov) { return (plane == Plane{aov} || plane == kAllPlanes) && p.has(aov); };
  Interleaved planes(encoding.precision);
  if (!plane.aov) planes.add({"R", "G", "B"}, DonePlane<Rgb>(p.color, {}, done));
  // What isn't done is transparent in the alpha that a job records, too.
  const Coverage alpha = coverage_of(p, plane, done, encoding.transparent);
  if (alpha.is_partial() && !wanted(Aov::alpha)) planes.add({"A"}, alpha);
  for (const AovEntry& row : aov_table()) {
    if (!wanted(row.aov)) continue;
    std::vector<std::string> names;
    for (const std::string_view name : row.channels)
      if (!name.empty()) names.emplace_back(name);
    with_plane(p, Plane{row.aov}, done, [&](auto values, AovLook) { planes.add(names, values); });
  }
  return std::move(planes).raster(p.rect);
}

/// RGBE's exponent goes to 127: beyond its greatest number, writers store something tiny.
float in_rgbe(float v) { return std::min(v, 0x1.fffffep126F); }

Raster rgbe_raster(const Pixels& p, Plane plane, const Done* done) {
  Interleaved planes(Precision::single);
  with_plane(p, plane, done, [&](auto values, AovLook) {
    planes.add({"R", "G", "B"}, Changed{values, [](auto value) {
                                          const auto [r, g, b] = triple(value);
                                          return Rgb{in_rgbe(r), in_rgbe(g), in_rgbe(b)};
                                        }});
  });
  return std::move(planes).raster(p.rect);
}

/// The greatest number of 16 bits: too far.
constexpr std::uint16_t kTooFar = 0xFFFF;

std::uint16_t millimetres(float depth) {
  constexpr double kMillimetre = 1e-3;
  return static_cast<std::uint16_t>(std::min(depth / kMillimetre + 0.5, double{kTooFar}));
}

/// A plane of single floats.
Raster single_raster(const Pixels& p, Plane plane, const Done* done, const Encoding& encoding) {
  const DonePlane<float> values(p.plane<float>(*plane.aov), std::get<float>(aov_entry(*plane.aov).empty), done);
  const DepthSensor sensor = encoding.sensor.value_or(DepthSensor{-kInfinity});
  const auto told = [=](float depth) { return depth < sensor.least ? 0 : depth > sensor.greatest ? kInfinity : depth; };
  Interleaved planes(Precision::single);
  if (sensor.is_in_millimetres)
    planes.add({"Y"}, Changed{values, [=](float depth) { return millimetres(told(depth)); }});
  else
    planes.add({"Y"}, Changed{values, told});
  return std::move(planes).raster(p.rect);
}

bool is_single(Plane plane) { return plane.aov && std::holds_alternative<float>(aov_entry(*plane.aov).empty); }

/// What RGBE can hold is finite, and neither negative nor in need of being exact.
bool fits_rgbe(Plane plane) {
  if (plane == kAllPlanes) return false;
  const AovLook look = plane.aov ? aov_entry(*plane.aov).look : AovLook::color;
  return look == AovLook::color || look == AovLook::linear || look == AovLook::heat;
}

bool can_hold_values(PixelValues values, Plane plane) {
  switch (values) {
    case PixelValues::display:
      return plane != kAllPlanes;
    case PixelValues::rgbe:
      return fits_rgbe(plane);
    case PixelValues::single:
      return is_single(plane);
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
         height <= limits.max_height && width <= limits.max_row_bytes / pixel &&
         std::uint64_t{width} * height <= limits.max_bytes / sizeof(float);
}

std::optional<Bytes> encode(const Pixels& pixels, Plane plane, const Encoding& encoding, const Done* done,
                            const std::stop_token& stop) {
  const auto width = static_cast<std::uint32_t>(pixels.rect.width());
  const auto height = static_cast<std::uint32_t>(pixels.rect.height());
  if (!has(pixels, plane) || !can_hold(encoding.format, plane, width, height, pixels.aovs())) return std::nullopt;
  switch (encoding.format) {
    case ImageFormat::png:
      if (encoding.sensor && encoding.sensor->is_in_millimetres && plane == Plane{Aov::depth})
        return write_png(single_raster(pixels, plane, done, encoding), stop);
      return write_png(display_raster(pixels, plane, done, encoding), stop);
    case ImageFormat::jpeg:
      return write_jpeg(display_raster(pixels, plane, done, encoding), encoding.jpeg, stop);
    case ImageFormat::tiff:
      return write_tiff(single_raster(pixels, plane, done, encoding), stop);
    case ImageFormat::exr:
      return write_with_oiio(encoding.format, exact_raster(pixels, plane, done, encoding), stop);
    case ImageFormat::hdr:
      return write_with_oiio(encoding.format, rgbe_raster(pixels, plane, done), stop);
  }
  return std::nullopt;
}

}  // namespace tessera
