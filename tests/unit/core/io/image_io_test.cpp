#include "core/io/image_io.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stop_token>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "core/io/display_curve.h"
#include "core/io/heat_color.h"
#include "core/io/oiio/write_with_oiio.h"
#include "core/io/png_file.h"
#include "core/math/rounding.h"
#include "tests/support/effort.h"

namespace tessera {
namespace {

const std::set<Aov> kAll = [] {
  std::set<Aov> aovs;
  for (const AovEntry& row : aov_table()) aovs.insert(row.aov);
  return aovs;
}();

Pixels sample() {
  Pixels p({0, 0, 2, 1}, kAll);
  p.color = {{0.5F, 2, 0}, {0, 0.0031308F, 1}};
  p.plane<float>(Aov::depth) = {1.5F, kInfinity};
  p.plane<Vec3>(Aov::normal) = {{0, 0, 1}, {0, 0, 0}};
  p.plane<std::uint32_t>(Aov::primitive_id) = {0xFFFFFFFE, kNoId};
  p.plane<std::uint32_t>(Aov::object_id) = {3, kNoId};
  p.plane<float>(Aov::cost_volumes) = {40, 10};
  p.plane<float>(Aov::cost_primitives) = {0, 0.5F};
  p.plane<Rgb>(Aov::albedo) = {{0.5F, 0.25F, 1}, {}};
  p.plane<Vec3>(Aov::position) = {{-1, 2, 3}, {1, 2, 5}};
  p.plane<float>(Aov::alpha) = {0.75F, 0};
  p.plane<std::uint32_t>(Aov::sample_count) = {64, 16};
  p.plane<Rgb>(Aov::variance) = {{0.5F, 0, 0.25F}, {}};
  p.plane<Rgb>(Aov::base_color) = {{0.25F, 64 / 255.0F, 2}, {1, 1, 1}};
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

/// Where in a pixel each channel is.
using Offsets = std::map<std::string, std::size_t>;

Offsets offsets_of(const OIIO::ImageSpec& spec) {
  Offsets offsets;
  std::size_t offset = 0;
  for (int c = 0; c < spec.nchannels; ++c) {
    offsets[spec.channelnames[static_cast<std::size_t>(c)]] = offset;
    offset += spec.channelformat(c).size();
  }
  return offsets;
}

TEST(ImageIo, PngHoldsSrgbBytes) {
  const auto file = encode(sample(), kColorPlane, {ImageFormat::png, {}});
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.png");
  ASSERT_EQ(image.spec.nchannels, 3);
  // 0.5 → 1.055 · 0.5^(1/2.4) − 0.055 = 0.7354 → 188; 2 is clamped; 0.0031308 · 12.92 = 0.04045 → 10.
  EXPECT_EQ(image.bytes(), (std::vector<std::uint8_t>{188, 255, 0, 0, 10, 255}));
}

TEST(ImageIo, PngOfAPartialImageIsTransparentWhereNothingIsYet) {
  const std::vector<std::uint8_t> done{1, 0};
  const auto file = encode(sample(), kColorPlane, {ImageFormat::png, {}}, &done);
  ASSERT_TRUE(file);
  const auto bytes = decode(*file, "x.png").bytes();
  ASSERT_EQ(bytes.size(), 8U);
  EXPECT_EQ(bytes[3], 255);
  EXPECT_EQ(bytes[7], 0);
}

TEST(ImageIo, PngComesBackAsItWas) {
  constexpr int kWidth = 37, kHeight = 5;
  for (const std::size_t channels : {3U, 4U}) {
    // Alpha is all or, for the first pixel and without colour, nothing: OpenImageIO multiplies colours by it.
    std::vector<std::byte> values(kWidth * kHeight * channels);
    for (std::size_t i = channels; i < values.size(); ++i)
      values[i] = static_cast<std::byte>(i % channels == 3 ? 255 : i * i % 251);
    Raster raster{kWidth, kHeight, {}, [&](std::int32_t y, std::byte* row) {
                    std::copy_n(values.begin() + y * static_cast<std::ptrdiff_t>(kWidth * channels), kWidth * channels,
                                row);
                  }};
    for (const char* name : {"R", "G", "B", "A"})
      if (raster.channels.size() < channels) raster.channels.push_back({name, ChannelType::byte});
    const auto file = write_png(raster);
    ASSERT_TRUE(file);
    const Decoded image = decode(*file, "x.png");
    EXPECT_EQ(image.native, values);
    EXPECT_EQ(image.spec.width, kWidth);
    EXPECT_EQ(image.spec.nchannels, static_cast<int>(channels));
    EXPECT_EQ(image.spec.get_string_attribute("oiio:ColorSpace"), "sRGB");
  }
}

TEST(ImageIo, ExrHoldsEveryPlaneAsItIs) {
  const auto file = encode(sample(), kAllPlanes, {ImageFormat::exr, {}});
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.exr");
  const Offsets at = offsets_of(image.spec);
  ASSERT_EQ(at.size(), 25U);
  const std::map<std::string, float> reals{
      {"R", 0.5F},          {"G", 2.0F},          {"B", 0.0F},           {"A", 0.75F},           {"Z", 1.5F},
      {"N.X", 0.0F},        {"N.Y", 0.0F},        {"N.Z", 1.0F},         {"P.X", -1.0F},         {"P.Y", 2.0F},
      {"P.Z", 3.0F},        {"cost.volumes", 40}, {"albedo.R", 0.5F},    {"albedo.G", 0.25F},    {"albedo.B", 1.0F},
      {"variance.R", 0.5F}, {"variance.G", 0.0F}, {"variance.B", 0.25F}, {"cost.primitives", 0}, {"baseColor.R", 0.25F},
      {"baseColor.B", 2}};
  for (const auto& [name, value] : reals) EXPECT_EQ(image.value<float>(at.at(name)), value) << name;
  EXPECT_EQ(image.value<std::uint32_t>(at.at("primitiveId")), 0xFFFFFFFE);
  EXPECT_EQ(image.value<std::uint32_t>(at.at("objectId")), 3U);
  EXPECT_EQ(image.value<std::uint32_t>(at.at("sampleCount")), 64U);
}

TEST(ImageIo, ExposureAndToneMapChangeWhatIsShown) {
  const auto bytes = [](const Look& look, ImageFormat format) {
    const Encoding encoding{.format = format, .jpeg = {100, Subsampling::s444}, .look = look};
    return decode(*encode(sample(), kColorPlane, encoding), format == ImageFormat::png ? "x.png" : "x.jpg").bytes();
  };
  const auto png = [&](const Look& look) { return bytes(look, ImageFormat::png); };
  // 0.5 · 2^-1 = 0.25 → 1.055 · 0.25^(1/2.4) − 0.055 = 0.5371 → 137; 2 · 2^-1 = 1 → 255.
  EXPECT_EQ(png({-1, ToneMap::none}), (std::vector<std::uint8_t>{137, 255, 0, 0, 5, 188}));
  EXPECT_EQ(png({}), png({0, ToneMap::none}));
  const Rgb mapped = Display({0, ToneMap::aces})({0.5F, 2, 0});
  EXPECT_EQ(png({0, ToneMap::aces})[0], display_byte(mapped.r));
  EXPECT_EQ(png({0, ToneMap::aces})[1], display_byte(mapped.g));
  EXPECT_LT(bytes({-3, ToneMap::none}, ImageFormat::jpeg)[0] + 40, bytes({}, ImageFormat::jpeg)[0]);
}

/// Two pixels of which the first is covered to a half and the second not at all.
Pixels half_covered() {
  Pixels p({0, 0, 2, 1}, {Aov::alpha});
  p.color = {{0.25F, 0.5F, 0}, {0, 0, 0}};
  p.plane<float>(Aov::alpha) = {0.5F, 0};
  return p;
}

TEST(ImageIo, APngOfATransparentImageHasTheColourOfWhatCoversIt) {
  const Encoding transparent{.format = ImageFormat::png, .transparent = true};
  const auto file = encode(half_covered(), kColorPlane, transparent);
  ASSERT_TRUE(file);
  // OpenImageIO multiplies colours by alpha, so the bytes of the file are asked for.
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file->data()), file->size());
  OIIO::ImageSpec as_it_is;
  as_it_is.attribute("oiio:UnassociatedAlpha", 1);
  OIIO::Filesystem::IOProxy* proxy = &memory;
  as_it_is.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const auto in = OIIO::ImageInput::open("x.png", &as_it_is, &memory);
  ASSERT_TRUE(in) << OIIO::geterror();
  ASSERT_EQ(in->spec().nchannels, 4);
  std::vector<std::uint8_t> bytes(8);
  in->read_image(0, 0, 0, 4, OIIO::TypeDesc::UINT8, bytes.data());
  // 0.25 of a half is 0.5 → 188, 0.5 of a half is 1 → 255; a half of 255 is rounded up.
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{188, 255, 0, 128, 0, 0, 0, 0}));
  EXPECT_EQ(decode(*encode(half_covered(), kColorPlane, {.format = ImageFormat::png}), "x.png").spec.nchannels, 3)
      << "alpha alone, as an AOV, doesn't make colour transparent";
  EXPECT_EQ(decode(*encode(half_covered(), Plane{Aov::alpha}, transparent), "x.png").spec.nchannels, 3);
  EXPECT_EQ(decode(*encode(half_covered(), kColorPlane, {.format = ImageFormat::jpeg, .transparent = true}), "x.jpg")
                .spec.nchannels,
            3);
}

TEST(ImageIo, ABackgroundShowsThroughAsItWasAskedFor) {
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg}) {
    Encoding over{.format = format, .jpeg = {100, Subsampling::s444}, .transparent = true};
    over.background = Rgb{0, display_light(100), display_light(200)};
    const bool is_png = format == ImageFormat::png;
    const Decoded image = decode(*encode(half_covered(), kColorPlane, over), is_png ? "x.png" : "x.jpg");
    EXPECT_EQ(image.spec.nchannels, 3);
    // In linear light: a half of 0.5 is 0.25 → 137; a half of 1 and a half of 0.127 is 0.564 → 198; a half of 0.578 is
    // 0.289 → 146.
    const std::vector<std::uint8_t> expected{137, 198, 146, 0, 100, 200};
    if (is_png) {
      EXPECT_EQ(image.bytes(), expected);
    } else {
      for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(image.bytes()[i], expected[i], 60) << i;
    }
  }
  // What is brighter than white doesn't outshine what is beside it in the pixel.
  Pixels bright = half_covered();
  bright.color[0] = {50, 50, 50};
  Encoding over{.format = ImageFormat::png, .transparent = true};
  over.background = Rgb{0, 0, 0};
  EXPECT_EQ(decode(*encode(bright, kColorPlane, over), "x.png").bytes()[0], 188);
  over.look.tone_map = ToneMap::aces;
  over.background = Rgb{1, 1, 1};
  EXPECT_EQ(decode(*encode(bright, kColorPlane, over), "x.png").bytes()[3], 255) << "isn't mapped itself";
  const std::vector<std::uint8_t> done{0, 0};
  EXPECT_EQ(decode(*encode(bright, kColorPlane, over, &done), "x.png").bytes()[0], 255) << "where nothing is yet";
}

TEST(ImageIo, AnExrOfATransparentImageIsMultipliedByItsAlpha) {
  const Encoding transparent{.format = ImageFormat::exr, .transparent = true};
  const std::vector<std::uint8_t> done{0, 1};
  for (const Plane plane : {kColorPlane, kAllPlanes}) {
    const Decoded image = decode(*encode(half_covered(), plane, transparent), "x.exr");
    ASSERT_EQ(image.spec.channelnames, (std::vector<std::string>{"R", "G", "B", "A"}));
    EXPECT_EQ(image.value<float>(0), 0.25F);
    EXPECT_EQ(image.value<float>(4), 0.5F);
    EXPECT_EQ(image.value<float>(12), 0.5F);
    EXPECT_EQ(image.value<float>(28), 0);
    const Decoded partial = decode(*encode(half_covered(), plane, transparent, &done), "x.exr");
    ASSERT_EQ(partial.spec.nchannels, 4);
    EXPECT_EQ(partial.value<float>(12), 0) << "nothing is there yet";
  }
}

TEST(ImageIo, AnExrOfHalfPrecisionKeepsItsIds) {
  Pixels p({0, 0, 1, 1}, {Aov::depth, Aov::object_id, Aov::normal});
  p.color = {{0.1F, 1e6F, 0.5F}};
  p.plane<float>(Aov::depth) = {kInfinity};
  p.plane<std::uint32_t>(Aov::object_id) = {0x12345678};
  p.plane<Vec3>(Aov::normal) = {{0, -0.25F, 1}};
  const Encoding half{.format = ImageFormat::exr, .precision = Precision::half};
  const Decoded image = decode(*encode(p, kAllPlanes, half), "x.exr");
  for (std::size_t c = 0; c < image.spec.channelnames.size(); ++c)
    EXPECT_EQ(image.spec.channelformat(static_cast<int>(c)),
              image.spec.channelnames[c] == "objectId" ? OIIO::TypeDesc::UINT : OIIO::TypeDesc::HALF);
  const Offsets offsets = offsets_of(image.spec);
  EXPECT_EQ(image.value<std::uint32_t>(offsets.at("objectId")), 0x12345678U);
  // By binary16: 0.1 is 0x2E66, 0.5 0x3800, 65504 0x7BFF, infinity 0x7C00, -0.25 0xB400, 1 0x3C00.
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("R")), 0x2E66);
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("G")), 0x7BFF);
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("B")), 0x3800);
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("Z")), 0x7C00);
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("N.Y")), 0xB400);
  EXPECT_EQ(image.value<std::uint16_t>(offsets.at("N.Z")), 0x3C00);
}

TEST(ImageIo, ExrSaysNothingOfTheTimeItWasWritten) {
  const auto file = encode(sample(), kAllPlanes, {ImageFormat::exr, {}});
  ASSERT_TRUE(file);
  EXPECT_EQ(decode(*file, "x.exr").spec.get_string_attribute("DateTime"), "1970:01:01 00:00:00");
}

TEST(ImageIo, PngHasAlphaWhereItIsAskedFor) {
  const auto bytes = decode(*encode(sample(), kColorPlane, {.format = ImageFormat::png, .has_alpha = true}), "x.png");
  EXPECT_EQ(bytes.bytes(), (std::vector<std::uint8_t>{188, 255, 0, 255, 0, 10, 255, 255}));
}

TEST(ImageIo, ABaseColourIsShownAsItsNumbers) {
  const auto file = encode(sample(), Plane{Aov::base_color}, {.format = ImageFormat::png});
  ASSERT_TRUE(file);
  EXPECT_EQ(decode(*file, "x.png").bytes(), (std::vector<std::uint8_t>{64, 64, 255, 255, 255, 255}));
}

/// A row of depths.
Pixels depths(std::vector<float> values) {
  Pixels p({0, 0, static_cast<std::int32_t>(values.size()), 1}, {Aov::depth});
  p.plane<float>(Aov::depth) = std::move(values);
  return p;
}

TEST(ImageIo, TiffHoldsFloatsAsTheyAre) {
  const Pixels p = depths({0, 1e-7F, 0.1F, 1234567, 3e38F, kInfinity});
  const auto file = encode(p, Plane{Aov::depth}, {.format = ImageFormat::tiff});
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.tif");
  ASSERT_EQ(image.spec.format, OIIO::TypeDesc::FLOAT);
  ASSERT_EQ(image.spec.nchannels, 1);
  ASSERT_EQ(image.spec.width, 6);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(image.value<float>(4 * i), p.plane<float>(Aov::depth)[i]);
}

TEST(ImageIo, ASensorTellsWhatIsTooNearAndTooFar) {
  const Pixels p = depths({0.49F, 0.5F, 0.7504F, 1.9996F, 2, 2.01F, kInfinity});
  Encoding told{.format = ImageFormat::tiff, .sensor = DepthSensor{0.5F, 2}};
  const Decoded metres = decode(*encode(p, Plane{Aov::depth}, told), "x.tif");
  const float expected[] = {0, 0.5F, 0.7504F, 1.9996F, 2, kInfinity, kInfinity};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(metres.value<float>(4 * i), expected[i]) << i;
  told.sensor->is_in_millimetres = true;
  const std::uint16_t in_millimetres[] = {0, 500, 750, 2000, 2000, 65535, 65535};
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::tiff}) {
    told.format = format;
    const Decoded image = decode(*encode(p, Plane{Aov::depth}, told), format == ImageFormat::png ? "x.png" : "x.tif");
    ASSERT_EQ(image.spec.format, OIIO::TypeDesc::UINT16);
    ASSERT_EQ(image.spec.nchannels, 1);
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(image.value<std::uint16_t>(2 * i), in_millimetres[i]) << i;
  }
  const Encoding all{.format = ImageFormat::tiff, .sensor = DepthSensor{0, kInfinity, true}};
  const Decoded far = decode(*encode(depths({65.534F, 65.6F, 1e30F}), Plane{Aov::depth}, all), "x.tif");
  EXPECT_EQ(far.value<std::uint16_t>(0), 65534);
  EXPECT_EQ(far.value<std::uint16_t>(2), 65535) << "beyond what millimetres of 16 bits can say";
  EXPECT_EQ(far.value<std::uint16_t>(4), 65535);
}

TEST(ImageIo, ATiffIsRowsFromTheTop) {
  Pixels p({0, 0, 3, 200}, {Aov::depth});
  for (std::size_t i = 0; i < 600; ++i) p.plane<float>(Aov::depth)[i] = static_cast<float>(i);
  const Decoded image = decode(*encode(p, Plane{Aov::depth}, {.format = ImageFormat::tiff}), "x.tif");
  ASSERT_EQ(image.spec.height, 200);
  for (std::size_t i = 0; i < 600; ++i) EXPECT_EQ(image.value<float>(4 * i), static_cast<float>(i));
  const std::vector<std::uint8_t> done(600, 0);
  const Decoded none = decode(*encode(p, Plane{Aov::depth}, {.format = ImageFormat::tiff}, &done), "x.tif");
  EXPECT_EQ(none.value<float>(0), kInfinity) << "nothing is there yet";
}

TEST(ImageIo, EncodesEveryPlaneThatAFormatCanHold) {
  const Pixels p = sample();
  std::vector<Plane> planes{kColorPlane};
  for (const Aov aov : kAll) planes.push_back({aov});
  for (const Plane& plane : planes) {
    EXPECT_TRUE(encode(p, plane, {ImageFormat::png, {}}));
    EXPECT_TRUE(encode(p, plane, {ImageFormat::jpeg, {}}));
    EXPECT_TRUE(encode(p, plane, {ImageFormat::exr, {}}));
  }
  EXPECT_TRUE(encode(p, kColorPlane, {ImageFormat::hdr, {}}));
  EXPECT_FALSE(encode(p, Plane{Aov::normal}, {ImageFormat::hdr, {}})) << "RGBE has no sign";
  EXPECT_TRUE(encode(p, Plane{Aov::cost_volumes}, {ImageFormat::hdr, {}}));
  EXPECT_TRUE(encode(p, Plane{Aov::cost_primitives}, {ImageFormat::hdr, {}}));
  for (const Aov aov : {Aov::albedo, Aov::alpha, Aov::sample_count, Aov::variance})
    EXPECT_TRUE(encode(p, {aov}, {ImageFormat::hdr, {}}));
  EXPECT_FALSE(encode(p, {Aov::position}, {ImageFormat::hdr, {}}));
  for (const Plane plane : {Plane{Aov::depth}, Plane{Aov::primitive_id}, Plane{Aov::object_id}, kAllPlanes})
    EXPECT_FALSE(encode(p, plane, {ImageFormat::hdr, {}}));
  EXPECT_FALSE(encode(p, kAllPlanes, {ImageFormat::png, {}}));
  for (const Plane& plane : planes)
    EXPECT_EQ(encode(p, plane, {ImageFormat::tiff, {}}).has_value(),
              plane.aov == Aov::depth || plane.aov == Aov::alpha || plane.aov == Aov::cost_volumes ||
                  plane.aov == Aov::cost_primitives);
  EXPECT_FALSE(encode(p, kAllPlanes, {ImageFormat::tiff, {}}));
  EXPECT_FALSE(can_hold(ImageFormat::tiff, Plane{Aov::depth}, 1 << 15, 1 << 15, {})) << "4 GiB of values";
  EXPECT_FALSE(encode(Pixels({0, 0, 1, 1}, {}), Plane{Aov::depth}, {ImageFormat::png, {}})) << "not recorded";
}

TEST(ImageIo, CostsAreAHeatMapUpToTheGreatest) {
  const auto pixel = [](const Pixels& p, std::size_t i) {
    const auto bytes = decode(*encode(p, Plane{Aov::cost_volumes}, {ImageFormat::png, {}}), "x.png").bytes();
    return std::array<std::uint8_t, 3>{bytes.at(i * 3), bytes.at(i * 3 + 1), bytes.at(i * 3 + 2)};
  };
  EXPECT_EQ(pixel(sample(), 0), heat_color(1));
  EXPECT_EQ(pixel(sample(), 1), heat_color(0.25));
  Pixels nothing = sample();
  nothing.plane<float>(Aov::cost_volumes) = {0, 0};
  EXPECT_EQ(pixel(nothing, 0), heat_color(0)) << "no cost is black, even where it is the greatest";
}

TEST(ImageIo, HdrHoldsCostsAsGrey) {
  const Decoded image = decode(*encode(sample(), Plane{Aov::cost_volumes}, {ImageFormat::hdr, {}}), "x.hdr");
  ASSERT_EQ(image.spec.nchannels, 3);
  for (const std::size_t channel : {0, 1, 2}) {
    EXPECT_NEAR(image.value<float>(channel * 4), 40, 0.4);
    EXPECT_NEAR(image.value<float>(12 + channel * 4), 10, 0.1);
  }
}

TEST(ImageIo, HdrKeepsRadianceToAPercent) {
  const auto file = encode(sample(), kColorPlane, {ImageFormat::hdr, {}});
  ASSERT_TRUE(file);
  const Decoded image = decode(*file, "x.hdr");
  ASSERT_EQ(image.spec.nchannels, 3);
  EXPECT_NEAR(image.value<float>(0), 0.5F, 0.02);
  EXPECT_NEAR(image.value<float>(4), 2.0F, 0.02);
}

TEST(ImageIo, HdrClampsWhatRgbeCannotHold) {
  Pixels p({0, 0, 1, 1}, {});
  p.color = {{3e38F, 1e38F, kInfinity}};  // 2^127 is 1.7e38.
  const Decoded image = decode(*encode(p, kColorPlane, {ImageFormat::hdr, {}}), "x.hdr");
  EXPECT_NEAR(image.value<float>(0), 1.7e38, 1e36);
  EXPECT_NEAR(image.value<float>(4), 1e38, 1e36);
  EXPECT_NEAR(image.value<float>(8), 1.7e38, 1e36);
}

/// The largest error of a channel in stripes of red and blue, one pixel wide.
int error_of_stripes(const JpegOptions& options) {
  Pixels p({0, 0, 64, 64}, {});
  for (std::size_t i = 0; i < p.color.size(); ++i) p.color[i] = i % 2 == 0 ? Rgb{1, 0, 0} : Rgb{0, 0, 1};
  const auto bytes = decode(*encode(p, kColorPlane, {ImageFormat::jpeg, options}), "x.jpg").bytes();
  EXPECT_EQ(bytes.size(), p.color.size() * 3);
  int error = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool lit = i / 3 % 2 == 0 ? i % 3 == 0 : i % 3 == 2;
    error = std::max(error, std::abs(bytes[i] - (lit ? 255 : 0)));
  }
  return error;
}

TEST(ImageIo, StripesKeepTheirColoursInAJpeg) {
  // Of a colour that is shared by two neighbours, each is half as red and half as blue as it should be, less what its
  // brightness tells: far more than the steps of quality 95, of which the coarsest is 10 of 255.
  EXPECT_LT(error_of_stripes({}), 20);
  EXPECT_GT(error_of_stripes({95, Subsampling::s422}), 60);
  EXPECT_GT(error_of_stripes({95, Subsampling::s420}), 60);
}

TEST(ImageIo, QualityTakesBytes) {
  Pixels p({0, 0, 64, 64}, {});
  for (std::size_t i = 0; i < p.color.size(); ++i) {
    const auto v = static_cast<float>(i * i % 251) / 251;
    p.color[i] = {v, 1 - v, v};
  }
  std::size_t last = 0;
  for (const int quality : {1, 10, 50, 90, 100}) {
    const std::size_t size = encode(p, kColorPlane, {ImageFormat::jpeg, {quality, Subsampling::s444}})->size();
    EXPECT_GT(size, last) << quality;
    last = size;
  }
}

struct Size {
  std::int32_t width, height;
};

/// Sizes at which something begins or ends in some format: blocks of 8 pixels, RGBE's runs (8 to 32,767 columns), 15
/// and 16 bits, libjpeg's limit, libpng's default limit.
constexpr Size kOddSizes[] = {{1, 1},     {7, 1},     {8, 1},         {1, 7},         {17, 33},      {32767, 1},
                              {32768, 1}, {1, 32768}, {65500, 1},     {65501, 1},     {1, 65500},    {1, 65501},
                              {1, 65536}, {65536, 1}, {1'000'000, 1}, {1'000'001, 1}, {1, 1'000'001}};

const char* name_of(ImageFormat format) {
  constexpr const char* kNames[] = {"x.png", "x.jpg", "x.exr", "x.hdr"};
  return kNames[static_cast<std::size_t>(format)];
}

/// What a PNG says of its size: OpenImageIO doesn't read those of more than a million columns or rows.
Size png_size(const std::vector<std::byte>& file) {
  const auto number = [&](std::size_t at) {
    std::int32_t v = 0;
    for (std::size_t i = at; i < at + 4; ++i) v = v << 8 | std::to_integer<int>(file.at(i));
    return v;
  };
  return {number(16), number(20)};
}

TEST(ImageIo, EveryFormatTakesTheSizesThatItSays) {
  for (const Size size : kOddSizes) {
    const std::int64_t area = std::int64_t{size.width} * size.height;
    const bool is_large = area > 500'000;
    Pixels p({0, 0, size.width, size.height}, kAll);
    p.color.back() = {0, 1, 0};
    const std::vector<std::uint8_t> done(p.color.size(), 1);
    for (const Plane plane : {kColorPlane, Plane{Aov::depth}, Plane{Aov::normal}, Plane{Aov::object_id},
                              Plane{Aov::cost_volumes}, kAllPlanes})
      for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::exr, ImageFormat::hdr}) {
        if (area > 1000 && plane != kColorPlane && plane != kAllPlanes) continue;
        if (is_large && plane == kAllPlanes) continue;
        SCOPED_TRACE(testing::Message() << size.width << " × " << size.height << ' ' << name_of(format) << " plane "
                                        << (plane.aov      ? aov_entry(*plane.aov).name
                                            : plane.is_all ? "all"
                                                           : "color"));
        const bool is_jpeg = format == ImageFormat::jpeg;
        const bool fits = !is_jpeg || (size.width <= 65500 && size.height <= 65500);
        EXPECT_LE(can_hold(format, plane, static_cast<std::uint32_t>(size.width),
                           static_cast<std::uint32_t>(size.height), kAll),
                  fits);
        const auto file = encode(p, plane, {format, {}}, plane == kAllPlanes ? &done : nullptr);
        const bool has_values = format == ImageFormat::exr || (plane != kAllPlanes && format != ImageFormat::hdr) ||
                                plane == kColorPlane || plane == Plane{Aov::cost_volumes};
        ASSERT_EQ(file.has_value(), fits && has_values);
        if (!file) continue;
        if (format == ImageFormat::png) {
          EXPECT_EQ(png_size(*file).width, size.width);
          EXPECT_EQ(png_size(*file).height, size.height);
          if (is_large) continue;
        }
        const Decoded image = decode(*file, name_of(format));
        EXPECT_EQ(image.spec.width, size.width);
        EXPECT_EQ(image.spec.height, size.height);
        if (plane != kColorPlane) continue;
        const std::size_t last = image.native.size() - 3 * image.spec.format.size();
        if (format == ImageFormat::exr || format == ImageFormat::hdr)
          EXPECT_NEAR(image.value<float>(last + 4), 1, 0.01);
        else
          EXPECT_GT(image.value<std::uint8_t>(last + 1), is_jpeg ? 40 : 254) << "JPEG's blocks may blur it";
      }
  }
}

/// As many pixels as a daemon takes unless told otherwise, in one row and in one column.
TEST(ImageIo, EncodesTheLargestImages) {
  if (!long_tests()) GTEST_SKIP() << "takes some GB, and some minutes: TESSERA_LONG_TESTS=1";
  constexpr std::int32_t kMost = 1 << 26;
  for (const Size size : {Size{kMost, 1}, Size{1, kMost}})
    for (const ImageFormat format : {ImageFormat::png, ImageFormat::exr, ImageFormat::hdr}) {
      SCOPED_TRACE(testing::Message() << size.width << " × " << size.height << ' ' << name_of(format));
      const auto file = encode(Pixels({0, 0, size.width, size.height}, {}), kColorPlane, {format, {}});
      ASSERT_TRUE(file);
      if (format == ImageFormat::png) {
        EXPECT_EQ(png_size(*file).width, size.width);
        EXPECT_EQ(png_size(*file).height, size.height);
        continue;
      }
      OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file->data()), file->size());
      const auto in = OIIO::ImageInput::open(name_of(format), nullptr, &memory);
      ASSERT_TRUE(in) << OIIO::geterror();
      EXPECT_EQ(in->spec().width, size.width);
      EXPECT_EQ(in->spec().height, size.height);
    }
}

TEST(ImageIo, SizesThatNoFileHoldsAreRefused) {
  EXPECT_TRUE(can_hold(ImageFormat::png, kColorPlane, 0x7FFFFFFF, 1, {}));
  EXPECT_FALSE(can_hold(ImageFormat::png, kColorPlane, 0x80000000, 1, {}));
  EXPECT_FALSE(can_hold(ImageFormat::png, kColorPlane, 0, 1, {}));
  EXPECT_FALSE(can_hold(ImageFormat::png, kColorPlane, 1, 0, {}));
  EXPECT_TRUE(can_hold(ImageFormat::exr, kColorPlane, 1 << 26, 1, kAll));
  EXPECT_FALSE(can_hold(ImageFormat::exr, kAllPlanes, 1 << 26, 1, kAll)) << "92 bytes a pixel are more than 2^31 a row";
  EXPECT_TRUE(can_hold(ImageFormat::exr, kAllPlanes, 1, 1 << 26, kAll));
  EXPECT_FALSE(can_hold(ImageFormat::exr, kColorPlane, 1, 1 << 30, {}));
}

TEST(ImageIo, WhatIsNotDoneLooksAsIfNothingWereThere) {
  const std::vector<std::uint8_t> done{1, 0};
  Pixels p = sample();
  p.plane<float>(Aov::depth)[1] = 5;
  p.plane<std::uint32_t>(Aov::object_id)[1] = 6;
  p.plane<float>(Aov::cost_volumes)[1] = 1000;
  const Decoded exr = decode(*encode(p, kAllPlanes, {ImageFormat::exr, {}}, &done), "x.exr");
  const Offsets offsets = offsets_of(exr.spec);
  const std::size_t offset = exr.spec.pixel_bytes(true);
  EXPECT_EQ(exr.value<float>(offsets.at("A")), 0.75F) << "the alpha that was recorded";
  EXPECT_EQ(exr.value<float>(offset + offsets.at("A")), 0);
  EXPECT_EQ(exr.value<float>(offset + offsets.at("B")), 0);
  EXPECT_EQ(exr.value<float>(offset + offsets.at("Z")), kInfinity);
  EXPECT_EQ(exr.value<std::uint32_t>(offset + offsets.at("objectId")), kNoId);
  const Decoded color = decode(*encode(p, kColorPlane, {ImageFormat::exr, {}}, &done), "x.exr");
  const std::size_t alpha = offsets_of(color.spec).at("A");
  EXPECT_EQ(color.value<float>(alpha), 1);
  EXPECT_EQ(color.value<float>(color.spec.pixel_bytes(true) + alpha), 0);
  const auto heat = decode(*encode(p, Plane{Aov::cost_volumes}, {ImageFormat::png, {}}, &done), "x.png").bytes();
  EXPECT_EQ(heat.at(0), heat_color(1)[0]) << "the greatest of what is there";
  EXPECT_EQ(heat.size(), 8U);
}

TEST(ImageIo, StopsBetweenRows) {
  constexpr std::int32_t kStopAt = 3;
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::exr, ImageFormat::hdr}) {
    const bool is_display = format == ImageFormat::png || format == ImageFormat::jpeg;
    std::stop_source stop;
    std::int32_t asked = 0;
    Raster raster{50'000, 1000, {}, [&](std::int32_t y, std::byte* row) {
                    std::fill_n(row, raster.row_bytes(), std::byte{0});
                    asked = y;
                    if (y == kStopAt) stop.request_stop();
                  }};
    for (const char* name : {"R", "G", "B"})
      raster.channels.push_back({name, is_display ? ChannelType::byte : ChannelType::real});
    const auto write = [&] {
      if (format == ImageFormat::png) return write_png(raster, stop.get_token());
      if (format == ImageFormat::jpeg) return write_jpeg(raster, {}, stop.get_token());
      return write_with_oiio(format, raster, stop.get_token());
    };
    EXPECT_FALSE(write()) << name_of(format);
    EXPECT_LT(asked, 32) << name_of(format) << ": within two of OpenEXR's blocks";
  }
}

}  // namespace
}  // namespace tessera
