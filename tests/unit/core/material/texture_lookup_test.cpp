// STRESS 79: lookups against exact arithmetic.
#include "core/material/texture_lookup.h"

#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/textures.h"

namespace tessera {
namespace {

using Exact = long double;

Texels random_texels(Random& random, std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  std::vector<std::uint8_t> values(std::size_t{width} * height * channels);
  for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(random.bits());
  return {width, height, channels, std::move(values)};
}

/// IEC 61966-2-1.
Exact linear(Exact encoded) {
  return encoded <= 0.04045L ? encoded / 12.92L : std::pow((encoded + 0.055L) / 1.055L, 2.4L);
}

/// By walking there, so that no formula for wrapping is shared with what is tested.
std::uint32_t walked(long at, std::uint32_t size, Wrap wrap) {
  const auto n = static_cast<long>(size);
  while (at < 0 || at >= n) {
    if (wrap == Wrap::clamp) return at < 0 ? 0 : size - 1;
    if (wrap == Wrap::repeat) at += at < 0 ? n : -n;
    if (wrap == Wrap::mirror) at = at < 0 ? -1 - at : 2 * n - 1 - at;
  }
  return static_cast<std::uint32_t>(at);
}

Exact exact_texel(const Texture& texture, long x, long y, std::uint32_t channel) {
  const Texels& texels = texture.image->texels();
  const auto& values = std::get<SharedValues<std::uint8_t>>(texels.values);
  const std::uint32_t column = walked(x, texels.width, texture.wrap_u), row = walked(y, texels.height, texture.wrap_v);
  const Exact value = values[(std::size_t{row} * texels.width + column) * texels.channels + channel] / 255.0L;
  return texture.is_srgb && channel < 3 ? linear(value) : value;
}

Exact exact_look_up(const Texture& texture, Vec2 uv, std::uint32_t channel) {
  const auto& m = texture.transform;
  const Exact u = (Exact{m[0]} * uv.x + Exact{m[1]} * uv.y + m[2]) * texture.image->texels().width;
  const Exact v = (Exact{m[3]} * uv.x + Exact{m[4]} * uv.y + m[5]) * texture.image->texels().height;
  if (texture.is_nearest) return exact_texel(texture, std::lround(std::floor(u)), std::lround(std::floor(v)), channel);
  const Exact x = std::floor(u - 0.5L), y = std::floor(v - 0.5L), right = u - 0.5L - x, down = v - 0.5L - y;
  const long ix = std::lround(x), iy = std::lround(y);
  return (exact_texel(texture, ix, iy, channel) * (1 - right) + exact_texel(texture, ix + 1, iy, channel) * right) *
             (1 - down) +
         (exact_texel(texture, ix, iy + 1, channel) * (1 - right) +
          exact_texel(texture, ix + 1, iy + 1, channel) * right) *
             down;
}

TEST(TextureLookup, IsWhatExactArithmeticTells_Stress79) {
  for (int seed = 0; seed < 400; ++seed) {
    Random random(seed);
    const auto side = [&] { return 1 + static_cast<std::uint32_t>(random.bits() % (seed % 3 == 0 ? 2 : 9)); };
    const std::uint32_t width = side(), height = side();
    Texture texture{.image = image_of(random_texels(random, width, height, 4)),
                    .wrap_u = static_cast<Wrap>(random.bits() % 3),
                    .wrap_v = static_cast<Wrap>(random.bits() % 3),
                    .is_nearest = random.bits() % 4 == 0,
                    .is_srgb = random.bits() % 2 == 0};
    if (seed % 2 == 1)
      for (float& m : texture.transform) m = static_cast<float>(random.uniform(-2, 2));
    for (int i = 0; i < 50; ++i) {
      Vec2 uv{static_cast<float>(random.uniform(-3, 3)), static_cast<float>(random.uniform(-3, 3))};
      if (seed % 2 == 0 && i % 3 == 0) {  // edges and centres of texels
        uv.x = static_cast<float>(static_cast<int>(random.bits() % 40) - 20) / 2 / static_cast<float>(width);
        uv.y = static_cast<float>(static_cast<int>(random.bits() % 40) - 20) / 2 / static_cast<float>(height);
        // Which texel the nearest one is depends on how the quotient was rounded, unless the texel's side is a fraction
        // of two.
        if (texture.is_nearest && (!std::has_single_bit(width) || !std::has_single_bit(height))) continue;
      }
      const Rgba got = look_up(texture, uv);
      for (std::uint32_t channel = 0; channel < 4; ++channel)
        ASSERT_NEAR(got[channel], static_cast<double>(exact_look_up(texture, uv, channel)), 1e-6)
            << "seed " << seed << ", " << width << " x " << height << ", uv " << uv.x << ' ' << uv.y;
    }
  }
}

TEST(TextureLookup, SrgbIsExactToAFloat) {
  std::vector<std::uint8_t> bytes(256);
  std::vector<std::uint16_t> words(65536);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = static_cast<std::uint16_t>(i);
  const Texels narrow{256, 1, 1, bytes}, wide{65536, 1, 1, words};
  for (std::uint32_t i = 0; i < 256; ++i) {
    const auto due = static_cast<double>(linear(i / 255.0L));
    ASSERT_NEAR(texel(narrow, true, i, 0)[0], due, 1e-7 * due) << i;
    ASSERT_EQ(texel(narrow, false, i, 0)[0], static_cast<float>(i) / 255.0F);
  }
  for (std::uint32_t i = 0; i < 65536; ++i) {
    const auto due = static_cast<double>(linear(i / 65535.0L));
    ASSERT_NEAR(texel(wide, true, i, 0)[0], due, 1e-7 * due) << i;
  }
}

TEST(TextureLookup, ChannelsAreWhatTheirNumberSays) {
  const auto look = [](std::uint32_t channels) {
    const Texels texels{1, 1, channels, std::vector<float>{0.25F, 0.5F, 0.75F, 0.125F}};
    return texel(texels, false, 0, 0);
  };
  EXPECT_EQ(look(1), (Rgba{0.25F, 0.25F, 0.25F, 1}));
  EXPECT_EQ(look(2), (Rgba{0.25F, 0.25F, 0.25F, 0.5F}));
  EXPECT_EQ(look(3), (Rgba{0.25F, 0.5F, 0.75F, 1}));
  EXPECT_EQ(look(4), (Rgba{0.25F, 0.5F, 0.75F, 0.125F}));
}

TEST(TextureLookup, WhatIsFarOffOrNoNumberIsSomeTexel) {
  const Texture texture{.image = grey_image(3, 2, {10, 20, 30, 40, 50, 60})};
  constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {kInf, -kInf, kNan, 1e30F, -1e30F, 16777217.0F, std::numeric_limits<float>::max()})
    for (const Vec2 uv : {Vec2{bad, 0.5F}, Vec2{0.5F, bad}, Vec2{bad, bad}}) {
      const float value = look_up(texture, uv)[0];
      EXPECT_TRUE(value >= 10 / 255.0F && value <= 60.01F / 255.0F) << bad << ": " << value;
    }
}

TEST(TextureLookup, MeansEndAndAreOnlyNoneWhereNothingIs) {
  const Texture dark{.image = grey_image(2, 2, {0, 0, 0, 0})}, half{.image = grey_image(2, 2, {0, 255, 0, 255})};
  constexpr float kFar = 1e12F, kNan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec2 at : {Vec2{0, 0}, Vec2{kFar, kFar}, Vec2{-kFar, 1e30F}, Vec2{kNan, 0}, Vec2{-3, 700000}}) {
    for (const Vec2 other : {at, Vec2{0.5F, 0.5F}}) {
      EXPECT_EQ(mean_around(dark, {at, other, at}) > 0.001, false);
      EXPECT_GT(mean_around(half, {at, other, at}), 0);
    }
  }
  EXPECT_EQ(mean_around(dark, {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}}), 0);
  EXPECT_NEAR(mean_around(half, {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}}), 0.5, 0.11);
}

TEST(TextureImage, IsDecodedOnceAndOnlyWhenAskedFor) {
  const auto decoded = std::make_shared<std::atomic<int>>(0);
  const auto image = image_of({1, 1, 1, std::vector<std::uint8_t>{7}}, decoded);
  EXPECT_EQ(image->problem(), "");
  EXPECT_EQ(*decoded, 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(image->texels().width, 1U);
  EXPECT_EQ(*decoded, 1);
}

TEST(TextureImage, WhatIsBrokenIsWhiteAndSaysWhy) {
  const TextureImage image(1, [] { return TextureImage::Decoded{{}, "It ends too early."}; });
  EXPECT_EQ(texel(image.texels(), true, 0, 0), (Rgba{1, 1, 1, 1}));
  EXPECT_EQ(image.problem(), "It ends too early.");
}

}  // namespace
}  // namespace tessera
