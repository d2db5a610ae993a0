#include "core/io/read_environment.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr std::uint64_t kPlenty = 1 << 26;

/// A file as others write it.
std::vector<std::byte> written(const char* name, OIIO::ImageSpec spec, const std::vector<float>& values) {
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  const auto out = OIIO::ImageOutput::create(name, &memory);
  EXPECT_TRUE(out && out->open(name, spec)) << OIIO::geterror();
  EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, values.data())) << out->geterror();
  EXPECT_TRUE(out->close());
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return {first, first + buffer.size()};
}

OIIO::ImageSpec spec_of(int width, int height, const std::vector<std::string>& channels) {
  OIIO::ImageSpec spec(width, height, static_cast<int>(channels.size()), OIIO::TypeDesc::FLOAT);
  spec.channelnames = channels;
  return spec;
}

const std::vector<float> kTwoByTwo{0.5F, 0.25F, 1, 2, 0, 0, 0, 0, 0, 8, 16, 1000};

std::string problem_of(const std::vector<std::byte>& file, std::uint64_t most_bytes = kPlenty) {
  const auto read = read_environment(file, most_bytes);
  const auto* problem = std::get_if<std::string>(&read);
  return problem ? *problem : "";
}

TEST(ReadEnvironment, ReadsBothFormatsFromTheTopRowOn) {
  for (const char* name : {"a.exr", "a.hdr"}) {
    SCOPED_TRACE(name);
    const auto read = read_environment(written(name, spec_of(2, 2, {"R", "G", "B"}), kTwoByTwo), kPlenty);
    const auto* map = std::get_if<EnvironmentMap>(&read);
    ASSERT_TRUE(map) << std::get<std::string>(read);
    EXPECT_EQ(map->width, 2U);
    EXPECT_EQ(map->height, 2U);
    ASSERT_EQ(map->texels.size(), 4U);
    EXPECT_EQ(map->texels[0], (Rgb{0.5F, 0.25F, 1}));
    EXPECT_EQ(map->texels[1], (Rgb{2, 0, 0}));
    EXPECT_EQ(map->texels[2], (Rgb{0, 0, 0}));
    EXPECT_NEAR(map->texels[3].b, 1000, 4);  // RGBE shares an exponent
  }
}

TEST(ReadEnvironment, TakesTheColorsAmongOtherChannelsAndGreyForAllThree) {
  const auto many =
      read_environment(written("a.exr", spec_of(1, 1, {"A", "B", "G", "R", "Z"}), {0.5F, 3, 2, 1, 9}), kPlenty);
  ASSERT_EQ(many.index(), 0U) << std::get<std::string>(many);
  EXPECT_EQ(std::get<EnvironmentMap>(many).texels[0], (Rgb{1, 2, 3}));
  const auto grey = read_environment(written("a.exr", spec_of(2, 1, {"Y"}), {4, 5}), kPlenty);
  ASSERT_EQ(grey.index(), 0U);
  EXPECT_EQ(std::get<EnvironmentMap>(grey).texels[1], (Rgb{5, 5, 5}));
  EXPECT_NE(problem_of(written("a.exr", spec_of(1, 1, {"depth"}), {1})).find("no channels R, G and B"),
            std::string::npos);
}

TEST(ReadEnvironment, CountsTexelsThatAreNoLight) {
  auto values = kTwoByTwo;
  values[0] = std::numeric_limits<float>::quiet_NaN();
  values[4] = -1;
  values[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(problem_of(written("a.exr", spec_of(2, 2, {"R", "G", "B"}), values)),
            "2 of its 4 texels are NaN, negative or above 1e18.");
  EXPECT_EQ(problem_of(written("a.exr", spec_of(2, 2, {"R", "G", "B"}), std::vector<float>(12))), "")
      << "black is fine";
}

TEST(ReadEnvironment, RefusesWhatIsLargerThanThereMayBe) {
  const auto file = written("a.exr", spec_of(64, 32, {"R", "G", "B"}), std::vector<float>(64 * 32 * 3));
  EXPECT_EQ(problem_of(file, 64 * 32 * sizeof(Rgb)), "");
  EXPECT_NE(problem_of(file, 64 * 32 * sizeof(Rgb) - 1).find("64 × 32"), std::string::npos);
  // A few bytes that claim to be a picture of 10^18 texels.
  const std::string claim = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000000 +X 1000000000\n\2\2\2\2";
  const auto* first = reinterpret_cast<const std::byte*>(claim.data());
  EXPECT_NE(problem_of({first, first + claim.size()}), "");
}

/// A file whose header claims that its windows end there.
std::vector<std::byte> with_windows_to(std::vector<std::byte> file, std::int32_t x, std::int32_t y) {
  for (const std::string name : {"dataWindow", "displayWindow"}) {
    const auto bytes = std::as_bytes(std::span(name));
    const auto at = std::ranges::search(file, bytes).begin() + std::ssize(name) + 1 + 6 + 4 + 8;
    for (int i = 0; i < 4; ++i) {
      at[i] = static_cast<std::byte>(x >> (8 * i));
      at[4 + i] = static_cast<std::byte>(y >> (8 * i));
    }
  }
  return file;
}

TEST(ReadEnvironment, DoesntBelieveAHeaderThatTheFileIsTooSmallFor) {
  const auto file = written("a.exr", spec_of(2, 2, {"R", "G", "B"}), kTwoByTwo);
  EXPECT_EQ(problem_of(with_windows_to(file, 1, 1)), "");
  EXPECT_EQ(problem_of(with_windows_to(file, 0, 4'999'999)), "It ends before its last row.");
  EXPECT_NE(problem_of(with_windows_to(file, 0, 1 << 30)).find("1 × 1073741825 texels"), std::string::npos);
  EXPECT_NE(problem_of(with_windows_to(file, 1 << 30, 1 << 30)).find("more memory"), std::string::npos);
  EXPECT_EQ(problem_of(with_windows_to(file, -5, 1)), "It has no texels.");
}

TEST(ReadEnvironment, RefusesACutOutOfALargerPicture) {
  OIIO::ImageSpec spec = spec_of(2, 2, {"R", "G", "B"});
  spec.x = 4;
  spec.full_width = 8;
  spec.full_height = 2;
  EXPECT_EQ(problem_of(written("a.exr", spec, kTwoByTwo)), "Its texels don't fill its display window.");
}

TEST(ReadEnvironment, RefusesOtherFilesAndBrokenOnes) {
  EXPECT_EQ(problem_of({}), "It is neither a Radiance (.hdr) nor an OpenEXR file.");
  EXPECT_NE(problem_of({std::byte{0x89}, std::byte{'P'}, std::byte{'N'}, std::byte{'G'}}), "");
  std::vector<float> values(32 * 16 * 3);
  Random random(1);
  for (float& value : values) value = static_cast<float>(random.uniform(0, 10));
  for (const char* name : {"a.exr", "a.hdr"}) {
    const auto file = written(name, spec_of(32, 16, {"R", "G", "B"}), values);
    for (const std::size_t length : {std::size_t{12}, file.size() / 4, file.size() / 2, file.size() - 40})
      EXPECT_NE(problem_of({file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length)}), "") << name << length;
    // Whatever is wrong with it, it is read or it isn't.
    for (int seed = 0; seed < 300; ++seed) {
      Random damage(seed);
      auto broken = file;
      for (int i = 0; i < 1 + seed % 4; ++i)
        broken[4 + damage.bits() % (seed % 2 ? file.size() - 4 : 200)] = static_cast<std::byte>(damage.bits());
      const auto read = read_environment(broken, 1 << 20);
      if (const auto* map = std::get_if<EnvironmentMap>(&read))
        EXPECT_EQ(map->texels.size(), std::size_t{map->width} * map->height);
      else
        EXPECT_NE(std::get<std::string>(read), "");
    }
  }
}

}  // namespace
}  // namespace tessera
