#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/io/display_curve.h"
#include "core/io/heat_color.h"

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

/// Channels side by side in memory, each of 32 bits: what OpenImageIO takes for files of mixed channel types.
class Channels {
 public:
  explicit Channels(std::size_t pixels) : pixels_(pixels) {}

  template <typename T>
  void add(std::vector<std::string> names, OIIO::TypeDesc type, const std::vector<T>& plane) {
    static_assert(sizeof(T) % 4 == 0);
    planes_.push_back({reinterpret_cast<const std::byte*>(plane.data()), sizeof(T)});
    for (std::string& name : names) {
      names_.push_back(std::move(name));
      types_.push_back(type);
    }
  }

  OIIO::ImageSpec spec(std::int32_t width, std::int32_t height) const {
    OIIO::ImageSpec spec(width, height, static_cast<int>(names_.size()), OIIO::TypeDesc::FLOAT);
    spec.channelnames = names_;
    if (std::ranges::count(types_, types_[0]) == std::ssize(types_))
      spec.set_format(types_[0]);
    else
      spec.channelformats = types_;
    const auto channel = [&](const char* name) {
      const auto found = std::ranges::find(names_, name);
      return found == names_.end() ? -1 : static_cast<int>(found - names_.begin());
    };
    spec.alpha_channel = channel("A");
    spec.z_channel = channel("Z");
    return spec;
  }

  Bytes interleaved() const {
    std::size_t stride = 0;
    for (const auto& plane : planes_) stride += plane.size;
    Bytes out(stride * pixels_);
    std::size_t at = 0;
    for (std::size_t i = 0; i < pixels_; ++i)
      for (const auto& plane : planes_) {
        std::copy_n(plane.data + i * plane.size, plane.size, out.data() + at);
        at += plane.size;
      }
    return out;
  }

 private:
  struct PlaneView {
    const std::byte* data;
    std::size_t size;
  };
  std::size_t pixels_;
  std::vector<PlaneView> planes_;
  std::vector<std::string> names_;
  std::vector<OIIO::TypeDesc> types_;
};

std::optional<Bytes> write(const char* name, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const void* data) {
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  const auto out = OIIO::ImageOutput::create(name, &memory);
  if (!out || !out->open(name, spec) || !out->write_image(type, data) || !out->close()) return std::nullopt;
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return Bytes(first, first + buffer.size());
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

std::optional<Bytes> encode_display(const Pixels& p, Plane plane, const char* name,
                                    const std::vector<std::uint8_t>* alpha) {
  std::vector<std::uint8_t> rgb = display_rgb(p, plane);
  OIIO::ImageSpec spec(p.rect.width(), p.rect.height(), alpha ? 4 : 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (std::string_view(name).ends_with("jpg")) {
    spec.attribute("CompressionQuality", 95);
  } else {
    // Trying every filter on every row and the usual level 6 cost three to five times as much for 5% fewer bytes.
    constexpr int kNoFilter = 8;  // libpng's PNG_FILTER_NONE
    spec.attribute("png:filter", kNoFilter);
    spec.attribute("png:compressionLevel", 3);
  }
  if (!alpha) return write(name, spec, OIIO::TypeDesc::UINT8, rgb.data());
  std::vector<std::uint8_t> rgba;
  rgba.reserve(alpha->size() * 4);
  for (std::size_t i = 0; i < alpha->size(); ++i)
    rgba.insert(rgba.end(),
                {rgb[i * 3], rgb[i * 3 + 1], rgb[i * 3 + 2], static_cast<std::uint8_t>((*alpha)[i] ? 255 : 0)});
  return write(name, spec, OIIO::TypeDesc::UINT8, rgba.data());
}

std::optional<Bytes> encode_exr(const Pixels& p, Plane plane, const std::vector<std::uint8_t>* done) {
  const auto wanted = [&](Plane one) { return (plane == one || plane == Plane::all) && has(p, one); };
  Channels channels(p.color.size());
  std::vector<float> alpha;
  if (wanted(Plane::color)) channels.add({"R", "G", "B"}, OIIO::TypeDesc::FLOAT, p.color);
  if (done) {
    alpha.assign(done->begin(), done->end());
    channels.add({"A"}, OIIO::TypeDesc::FLOAT, alpha);
  }
  if (wanted(Plane::depth)) channels.add({"Z"}, OIIO::TypeDesc::FLOAT, p.depth);
  if (wanted(Plane::normal)) channels.add({"N.X", "N.Y", "N.Z"}, OIIO::TypeDesc::FLOAT, p.normal);
  if (wanted(Plane::primitive_id)) channels.add({"primitiveId"}, OIIO::TypeDesc::UINT, p.primitive_id);
  if (wanted(Plane::object_id)) channels.add({"objectId"}, OIIO::TypeDesc::UINT, p.object_id);
  if (wanted(Plane::cost_volumes)) channels.add({"cost.volumes"}, OIIO::TypeDesc::FLOAT, p.cost_volumes);
  if (wanted(Plane::cost_primitives)) channels.add({"cost.primitives"}, OIIO::TypeDesc::FLOAT, p.cost_primitives);
  OIIO::ImageSpec spec = channels.spec(p.rect.width(), p.rect.height());
  spec.attribute("compression", "zip");
  spec.attribute("DateTime", "1970:01:01 00:00:00");  // else OpenImageIO writes the time: equal pixels, equal bytes
  spec.attribute("oiio:ColorSpace", "Linear");
  return write("image.exr", spec, OIIO::TypeDesc::UNKNOWN, channels.interleaved().data());
}

std::optional<Bytes> encode_hdr(const Pixels& p, Plane plane) {
  const auto write_rgb = [&](const void* data) {
    const OIIO::ImageSpec spec(p.rect.width(), p.rect.height(), 3, OIIO::TypeDesc::FLOAT);
    return write("image.hdr", spec, OIIO::TypeDesc::FLOAT, data);
  };
  switch (plane) {
    case Plane::color:
      return write_rgb(p.color.data());
    case Plane::normal:
      return write_rgb(p.normal.data());
    case Plane::cost_volumes:
    case Plane::cost_primitives: {
      std::vector<Rgb> grey;
      for (const float v : costs(p, plane)) grey.push_back({v, v, v});
      return write_rgb(grey.data());
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
  try {
    switch (format) {
      case ImageFormat::exr:
        return encode_exr(pixels, plane, done);
      case ImageFormat::hdr:
        return encode_hdr(pixels, plane);
      case ImageFormat::png:
        return plane == Plane::all ? std::nullopt : encode_display(pixels, plane, "image.png", done);
      case ImageFormat::jpeg:
        return plane == Plane::all ? std::nullopt : encode_display(pixels, plane, "image.jpg", nullptr);
    }
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace tessera
