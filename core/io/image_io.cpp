#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "core/io/display_curve.h"
#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"

namespace tessera {
namespace {

using Bytes = std::vector<std::byte>;

std::uint8_t unit_byte(double v) { return static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5); }

/// A hue of its own for each id, by hashing (Murmur3's finalizer).
std::array<std::uint8_t, 3> id_color(std::uint32_t id) {
  if (id == kNoId) return {0, 0, 0};
  id = (id ^ (id >> 16)) * 0x85EBCA6BU;
  id = (id ^ (id >> 13)) * 0xC2B2AE35U;
  id ^= id >> 16;
  return {static_cast<std::uint8_t>(64 + id % 192), static_cast<std::uint8_t>(64 + (id >> 8) % 192),
          static_cast<std::uint8_t>(64 + (id >> 16) % 192)};
}

const std::vector<float>& costs(const Pixels& p, Plane plane) {
  return plane == Plane::cost_volumes ? p.cost_volumes : p.cost_primitives;
}

/// 8-bit RGB of a plane, for people to look at.
std::vector<std::uint8_t> display_rgb(const Pixels& p, Plane plane) {
  std::vector<std::uint8_t> out;
  out.reserve(p.color.size() * 3);
  const auto add = [&](std::uint8_t r, std::uint8_t g, std::uint8_t b) { out.insert(out.end(), {r, g, b}); };
  switch (plane) {
    case Plane::color:
      for (const Rgb& c : p.color) add(display_byte(c.r), display_byte(c.g), display_byte(c.b));
      break;
    case Plane::depth: {
      float nearest = kInfinity, farthest = 0;
      for (const float d : p.depth)
        if (std::isfinite(d)) nearest = std::min(nearest, d), farthest = std::max(farthest, d);
      const double range = std::max(double{farthest} - nearest, 1e-30);
      for (const float d : p.depth) {
        const std::uint8_t v = std::isfinite(d) ? unit_byte(1 - (d - nearest) / range * 0.9) : 0;
        add(v, v, v);
      }
      break;
    }
    case Plane::normal:
      for (const Vec3& n : p.normal) add(unit_byte(n.x / 2 + 0.5), unit_byte(n.y / 2 + 0.5), unit_byte(n.z / 2 + 0.5));
      break;
    case Plane::primitive_id:
    case Plane::object_id:
      for (const std::uint32_t id : plane == Plane::object_id ? p.object_id : p.primitive_id) {
        const auto c = id_color(id);
        add(c[0], c[1], c[2]);
      }
      break;
    case Plane::cost_volumes:
    case Plane::cost_primitives: {
      const std::vector<float>& cost = costs(p, plane);
      const double most = std::max(double{*std::ranges::max_element(cost)}, 1e-30);
      for (const float v : cost) {
        const auto c = heat_color(v / most);
        add(c[0], c[1], c[2]);
      }
      break;
    }
    case Plane::all:
      break;
  }
  return out;
}

/// Planes of 32-bit values, whose pixels are to be put together.
class Planes {
 public:
  template <typename T>
  void add(std::vector<std::string> names, ChannelType type, const std::vector<T>& plane) {
    static_assert(sizeof(T) % 4 == 0);
    planes_.push_back({std::as_bytes(std::span(plane)), sizeof(T)});
    for (std::string& name : names) channels_.push_back({std::move(name), type});
  }

  const std::vector<Channel>& channels() const { return channels_; }

  Bytes interleaved(std::size_t pixels) const {
    std::size_t stride = 0;
    for (const PlaneView& plane : planes_) stride += plane.pixel_bytes;
    Bytes out(stride * pixels);
    std::byte* at = out.data();
    for (std::size_t i = 0; i < pixels; ++i)
      for (const PlaneView& plane : planes_)
        at = std::ranges::copy(plane.values.subspan(i * plane.pixel_bytes, plane.pixel_bytes), at).out;
    return out;
  }

 private:
  struct PlaneView {
    std::span<const std::byte> values;
    std::size_t pixel_bytes;
  };
  std::vector<Channel> channels_;
  std::vector<PlaneView> planes_;
};

std::vector<Channel> rgb_channels(ChannelType type) { return {{"R", type}, {"G", type}, {"B", type}}; }

/// The one place that decides what writes a format. A PNG is what nearly every job asks for, and libpng is there at
/// once; the rest is OpenImageIO's.
std::optional<Bytes> write(ImageFormat format, const Raster& raster) {
  return format == ImageFormat::png ? write_png(raster) : write_with_oiio(format, raster);
}

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

std::optional<Bytes> encode_display(const Pixels& p, Plane plane, ImageFormat format,
                                    const std::vector<std::uint8_t>* alpha) {
  if (plane == Plane::all) return std::nullopt;
  const std::vector<std::uint8_t> rgb = display_rgb(p, plane);
  Raster raster{p.rect.width(), p.rect.height(), rgb_channels(ChannelType::byte), std::as_bytes(std::span(rgb))};
  if (!alpha) return write(format, raster);
  std::vector<std::uint8_t> rgba;
  rgba.reserve(alpha->size() * 4);
  for (std::size_t i = 0; i < alpha->size(); ++i)
    rgba.insert(rgba.end(),
                {rgb[i * 3], rgb[i * 3 + 1], rgb[i * 3 + 2], static_cast<std::uint8_t>((*alpha)[i] ? 255 : 0)});
  raster.channels.push_back({"A", ChannelType::byte});
  raster.values = std::as_bytes(std::span(rgba));
  return write(format, raster);
}

std::optional<Bytes> encode_exr(const Pixels& p, Plane plane, const std::vector<std::uint8_t>* done) {
  const auto wanted = [&](Plane one) { return (plane == one || plane == Plane::all) && has(p, one); };
  Planes planes;
  std::vector<float> alpha;
  if (wanted(Plane::color)) planes.add({"R", "G", "B"}, ChannelType::real, p.color);
  if (done) {
    alpha.assign(done->begin(), done->end());
    planes.add({"A"}, ChannelType::real, alpha);
  }
  if (wanted(Plane::depth)) planes.add({"Z"}, ChannelType::real, p.depth);
  if (wanted(Plane::normal)) planes.add({"N.X", "N.Y", "N.Z"}, ChannelType::real, p.normal);
  if (wanted(Plane::primitive_id)) planes.add({"primitiveId"}, ChannelType::id, p.primitive_id);
  if (wanted(Plane::object_id)) planes.add({"objectId"}, ChannelType::id, p.object_id);
  if (wanted(Plane::cost_volumes)) planes.add({"cost.volumes"}, ChannelType::real, p.cost_volumes);
  if (wanted(Plane::cost_primitives)) planes.add({"cost.primitives"}, ChannelType::real, p.cost_primitives);
  const Bytes values = planes.interleaved(p.color.size());
  return write(ImageFormat::exr, {p.rect.width(), p.rect.height(), planes.channels(), values});
}

std::optional<Bytes> encode_hdr(const Pixels& p, Plane plane) {
  const auto write_rgb = [&](const auto& values) {
    return write(ImageFormat::hdr,
                 {p.rect.width(), p.rect.height(), rgb_channels(ChannelType::real), std::as_bytes(std::span(values))});
  };
  switch (plane) {
    case Plane::color:
      return write_rgb(p.color);
    case Plane::normal:
      return write_rgb(p.normal);
    case Plane::cost_volumes:
    case Plane::cost_primitives: {
      std::vector<Rgb> grey;
      for (const float v : costs(p, plane)) grey.push_back({v, v, v});
      return write_rgb(grey);
    }
    case Plane::depth:
    case Plane::primitive_id:
    case Plane::object_id:
    case Plane::all:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Bytes> encode(const Pixels& pixels, Plane plane, ImageFormat format,
                            const std::vector<std::uint8_t>* done) {
  if (!has(pixels, plane)) return std::nullopt;
  switch (format) {
    case ImageFormat::exr:
      return encode_exr(pixels, plane, done);
    case ImageFormat::hdr:
      return encode_hdr(pixels, plane);
    case ImageFormat::png:
      return encode_display(pixels, plane, format, done);
    case ImageFormat::jpeg:
      return encode_display(pixels, plane, format, nullptr);
  }
  return std::nullopt;
}

}  // namespace tessera
