#include "core/io/image_io.h"

#include <array>
#include <cstring>
#include <map>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"

namespace tessera {
namespace {

const std::set<Aov> kAll{Aov::depth,     Aov::normal,       Aov::primitive_id,
                         Aov::object_id, Aov::cost_volumes, Aov::cost_primitives};

Pixels sample() {
  Pixels p({0, 0, 2, 1}, kAll);
  p.color = {{0.5F, 2, 0}, {0, 0.0031308F, 1}};
  p.depth = {1.5F, kInfinity};
  p.normal = {{0, 0, 1}, {0, 0, 0}};
  p.primitive_id = {0xFFFFFFFE, kNoId};
  p.object_id = {3, kNoId};
  p.cost_volumes = {40, 10};
  p.cost_primitives = {0, 0.5F};
  return p;
}

struct Decoded {
  OIIO::ImageSpec spec;
  std::vector<std::byte> native;
  std::vector<std::uint8_t> bytes() const {
    const auto* first = reinterpret_cast<const std::uint8_t*>(native.data());
    return {first, first + native.size()};
  }
  template <typename T>
  T value(std::size_t offset) const {
    T v;
    std::memcpy(&v, native.data() + offset, sizeof v);
    return v;
  }
};

Decoded decode(const std::vector<std::byte>& file, const char* name) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file.data()), file.size());
  const auto in = OIIO::ImageInput::open(name, nullptr, &memory);
  if (!in) return {};
  Decoded out{in->spec(), {}};
  out.native.resize(out.spec.image_bytes(true));
  in->read_image(0, 0, 0, out.spec.nchannels, OIIO::TypeDesc::UNKNOWN, out.native.data());
  return out;
}

TEST(ImageIo, PngHoldsSrgbBytes) {
  const auto file = encode(sample(), Plane::color, ImageFormat::png);
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.png");
  ASSERT_EQ(image.spec.nchannels, 3);
  // 0.5 → 1.055 · 0.5^(1/2.4) − 0.055 = 0.7354 → 188; 2 is clamped; 0.0031308 · 12.92 = 0.04045 → 10.
  EXPECT_EQ(image.bytes(), (std::vector<std::uint8_t>{188, 255, 0, 0, 10, 255}));
}

TEST(ImageIo, PngOfAPartialImageIsTransparentWhereNothingIsYet) {
  const std::vector<std::uint8_t> done{1, 0};
  const auto file = encode(sample(), Plane::color, ImageFormat::png, &done);
  ASSERT_TRUE(file);
  const auto bytes = decode(*file, "x.png").bytes();
  ASSERT_EQ(bytes.size(), 8U);
  EXPECT_EQ(bytes[3], 255);
  EXPECT_EQ(bytes[7], 0);
}

TEST(ImageIo, PngIsTheSameImageByEitherLibrary) {
  constexpr int kWidth = 37, kHeight = 5;
  for (const std::size_t channels : {3U, 4U}) {
    // Alpha is all or, for the first pixel and without colour, nothing: OpenImageIO multiplies colours by it.
    std::vector<std::byte> values(kWidth * kHeight * channels);
    for (std::size_t i = channels; i < values.size(); ++i)
      values[i] = static_cast<std::byte>(i % channels == 3 ? 255 : i * i % 251);
    Raster raster{kWidth, kHeight, {}, values};
    for (const char* name : {"R", "G", "B", "A"})
      if (raster.channels.size() < channels) raster.channels.push_back({name, ChannelType::byte});
    const auto ours = write_png(raster), theirs = write_with_oiio(ImageFormat::png, raster);
    ASSERT_TRUE(ours && theirs);
    const Decoded image = decode(*ours, "x.png"), expected = decode(*theirs, "x.png");
    EXPECT_EQ(image.native, values);
    EXPECT_EQ(image.native, expected.native);
    EXPECT_EQ(image.spec.width, kWidth);
    EXPECT_EQ(image.spec.channelnames, expected.spec.channelnames);
    EXPECT_EQ(image.spec.get_string_attribute("oiio:ColorSpace"), "sRGB");
  }
}

TEST(ImageIo, ExrHoldsEveryPlaneAsItIs) {
  const auto file = encode(sample(), Plane::all, ImageFormat::exr);
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.exr");
  ASSERT_EQ(image.spec.nchannels, 11);
  std::map<std::string, std::size_t> offsets;
  for (std::size_t c = 0, offset = 0; c < 11; ++c) {
    offsets[image.spec.channelnames[c]] = offset;
    offset += image.spec.channelformat(static_cast<int>(c)).size();
  }
  EXPECT_EQ(image.value<float>(offsets.at("R")), 0.5F);
  EXPECT_EQ(image.value<float>(offsets.at("G")), 2.0F);
  EXPECT_EQ(image.value<float>(offsets.at("B")), 0.0F);
  EXPECT_EQ(image.value<float>(offsets.at("Z")), 1.5F);
  EXPECT_EQ(image.value<float>(offsets.at("N.X")), 0.0F);
  EXPECT_EQ(image.value<float>(offsets.at("N.Y")), 0.0F);
  EXPECT_EQ(image.value<float>(offsets.at("N.Z")), 1.0F);
  EXPECT_EQ(image.value<std::uint32_t>(offsets.at("primitiveId")), 0xFFFFFFFE);
  EXPECT_EQ(image.value<std::uint32_t>(offsets.at("objectId")), 3U);
  EXPECT_EQ(image.value<float>(offsets.at("cost.volumes")), 40.0F);
  EXPECT_EQ(image.value<float>(offsets.at("cost.primitives")), 0.0F);
}

TEST(ImageIo, ExrSaysNothingOfTheTimeItWasWritten) {
  const auto file = encode(sample(), Plane::all, ImageFormat::exr);
  ASSERT_TRUE(file);
  EXPECT_EQ(decode(*file, "x.exr").spec.get_string_attribute("DateTime"), "1970:01:01 00:00:00");
}

TEST(ImageIo, EncodesEveryPlaneThatAFormatCanHold) {
  const Pixels p = sample();
  for (const Plane plane : {Plane::color, Plane::depth, Plane::normal, Plane::primitive_id, Plane::object_id,
                            Plane::cost_volumes, Plane::cost_primitives}) {
    EXPECT_TRUE(encode(p, plane, ImageFormat::png));
    EXPECT_TRUE(encode(p, plane, ImageFormat::jpeg));
    EXPECT_TRUE(encode(p, plane, ImageFormat::exr));
  }
  EXPECT_TRUE(encode(p, Plane::color, ImageFormat::hdr));
  EXPECT_TRUE(encode(p, Plane::normal, ImageFormat::hdr));
  EXPECT_TRUE(encode(p, Plane::cost_volumes, ImageFormat::hdr));
  EXPECT_TRUE(encode(p, Plane::cost_primitives, ImageFormat::hdr));
  EXPECT_FALSE(encode(p, Plane::depth, ImageFormat::hdr));
  EXPECT_FALSE(encode(p, Plane::all, ImageFormat::png));
  EXPECT_FALSE(encode(Pixels({0, 0, 1, 1}, {}), Plane::depth, ImageFormat::png)) << "not recorded";
}

TEST(ImageIo, CostsAreAHeatMapUpToTheGreatest) {
  const auto pixel = [](const Pixels& p, std::size_t i) {
    const auto bytes = decode(*encode(p, Plane::cost_volumes, ImageFormat::png), "x.png").bytes();
    return std::array<std::uint8_t, 3>{bytes.at(i * 3), bytes.at(i * 3 + 1), bytes.at(i * 3 + 2)};
  };
  EXPECT_EQ(pixel(sample(), 0), heat_color(1));
  EXPECT_EQ(pixel(sample(), 1), heat_color(0.25));
  Pixels nothing = sample();
  nothing.cost_volumes = {0, 0};
  EXPECT_EQ(pixel(nothing, 0), heat_color(0)) << "no cost is black, even where it is the greatest";
}

TEST(ImageIo, HdrHoldsCostsAsGrey) {
  const Decoded image = decode(*encode(sample(), Plane::cost_volumes, ImageFormat::hdr), "x.hdr");
  ASSERT_EQ(image.spec.nchannels, 3);
  for (const std::size_t channel : {0, 1, 2}) {
    EXPECT_NEAR(image.value<float>(channel * 4), 40, 0.4);
    EXPECT_NEAR(image.value<float>(12 + channel * 4), 10, 0.1);
  }
}

TEST(ImageIo, HdrKeepsRadianceToAPercent) {
  const auto file = encode(sample(), Plane::color, ImageFormat::hdr);
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.hdr");
  ASSERT_EQ(image.spec.nchannels, 3);
  EXPECT_NEAR(image.value<float>(0), 0.5F, 0.02);
  EXPECT_NEAR(image.value<float>(4), 2.0F, 0.02);
}

}  // namespace
}  // namespace tessera
