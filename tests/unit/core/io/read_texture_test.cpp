#include "core/io/read_texture.h"

#include <cstdlib>
#include <string>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "core/math/rounding.h"

namespace tessera {
namespace {

constexpr std::uint64_t kPlentyOfBytes = 1 << 30;

/// A picture of one row, whose alpha isn't multiplied into it, in a file of that kind.
template <typename T>
ImageFile file_of(const char* name, OIIO::TypeDesc type, int channels, const std::vector<T>& values) {
  OIIO::ImageSpec spec(static_cast<int>(values.size()) / channels, 1, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto out = OIIO::ImageOutput::create(name, &memory);
  EXPECT_TRUE(out && out->open(name, spec) && out->write_image(type, values.data()) && out->close())
      << OIIO::geterror();
  std::vector<std::byte> file;
  for (const unsigned char byte : bytes) file.push_back(static_cast<std::byte>(byte));
  return std::make_shared<const std::vector<std::byte>>(std::move(file));
}

std::shared_ptr<const TextureImage> opened(ImageFile file, std::uint64_t most_bytes = kPlentyOfBytes) {
  auto read = open_texture(std::move(file), most_bytes);
  if (const auto* why = std::get_if<std::string>(&read)) ADD_FAILURE() << *why;
  auto* image = std::get_if<std::shared_ptr<const TextureImage>>(&read);
  return image ? *image : nullptr;
}

std::string refusal(ImageFile file, std::uint64_t most_bytes = kPlentyOfBytes) {
  auto read = open_texture(std::move(file), most_bytes);
  const auto* why = std::get_if<std::string>(&read);
  return why ? *why : "";
}

ImageFile bytes_of(std::string_view text) {
  std::vector<std::byte> file;
  for (const char c : text) file.push_back(static_cast<std::byte>(c));
  return std::make_shared<const std::vector<std::byte>>(std::move(file));
}

const std::vector<std::uint8_t> kBytes{200, 100, 50, 128, 10, 20, 30, 255, 7, 9, 11, 0};

TEST(ReadTexture, AlphaStaysBesideTheColors) {
  const auto image = opened(file_of("a.png", OIIO::TypeDesc::UINT8, 4, kBytes));
  ASSERT_TRUE(image);
  EXPECT_EQ(std::get<SharedValues<std::uint8_t>>(image->texels().values), kBytes);
  EXPECT_EQ(image->problem(), "");
}

TEST(ReadTexture, SixteenBitsStaySixteen) {
  const std::vector<std::uint16_t> values{1, 258, 65535, 300, 40000, 7};
  const auto image = opened(file_of("a.png", OIIO::TypeDesc::UINT16, 3, values));
  ASSERT_TRUE(image);
  EXPECT_EQ(std::get<SharedValues<std::uint16_t>>(image->texels().values), values);
  EXPECT_GE(image->bytes(), 12U);
}

TEST(ReadTexture, FloatsStayFloatsAndThoseThatAreNoneAreToldAndCountAsZero) {
  const std::vector<float> values{1e4F, std::nanf(""), -0.5F, kInfinity, 3e-5F, 1};
  const auto image = opened(file_of("a.exr", OIIO::TypeDesc::FLOAT, 3, values));
  ASSERT_TRUE(image);
  EXPECT_EQ(std::get<SharedValues<float>>(image->texels().values), (std::vector<float>{1e4F, 0, 0, 0, 3e-5F, 1}));
  EXPECT_NE(image->problem().find("3 of its numbers"), std::string::npos) << image->problem();
}

/// 2 × 2 texels of (200, 100, 50), half transparent, as cwebp -lossless writes them.
constexpr std::string_view kWebP(
    "RIFF\x1e\0\0\0WEBPVP8L\x11\0\0\0\x2f\x01\x40\0\x10\x07\x50\xb2\x22\x57\xa6\x80\x81\x88\xe8\x7f\0\0", 38);

TEST(ReadTexture, WebPsColorsAreAsBrightAsTheyWere) {
  const auto image = opened(bytes_of(kWebP));
  ASSERT_TRUE(image);
  const auto values = std::get<SharedValues<std::uint8_t>>(image->texels().values);
  ASSERT_EQ(values.size(), 16U);
  const int due[] = {200, 100, 50, 128};
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], due[i % 4], 1) << i;
}

TEST(ReadTexture, WhatIsTooLargeIsRefusedByItsHeader) {
  std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\x06\0\0\0\0\0\0\0", 33);
  EXPECT_NE(refusal(bytes_of(png)).find("60000 × 60000"), std::string::npos);
  EXPECT_NE(refusal(file_of("a.png", OIIO::TypeDesc::UINT8, 4, kBytes), 11), "");
  EXPECT_EQ(refusal(file_of("a.png", OIIO::TypeDesc::UINT8, 4, kBytes), 12), "");
}

TEST(ReadTexture, FilesOfMoreThanFourChannelsAreRefused) {
  const std::vector<std::uint8_t> values(20, 9);
  EXPECT_NE(refusal(file_of("a.tif", OIIO::TypeDesc::UINT8, 5, values)).find("more than four channels"),
            std::string::npos);
  EXPECT_EQ(refusal(file_of("a.tif", OIIO::TypeDesc::UINT8, 4, values)), "");
}

TEST(ReadTexture, WhatIsWrongIsSaidInALine) {
  const ImageFile whole = file_of("a.png", OIIO::TypeDesc::UINT8, 3, std::vector<std::uint8_t>(30000, 77));
  std::vector<std::byte> broken(whole->begin(), whole->end());
  broken[broken.size() - 14] ^= std::byte{1};  // the checksum of the pixels, which the end's 12 bytes follow
  const auto image = opened(std::make_shared<const std::vector<std::byte>>(std::move(broken)));
  ASSERT_TRUE(image);
  image->texels();
  EXPECT_NE(image->problem(), "");
  EXPECT_EQ(image->problem().find('\n'), std::string::npos) << image->problem();
}

TEST(ReadTexture, WhatEndsTooEarlyIsWhiteAndSaysSo) {
  const ImageFile whole = file_of("a.png", OIIO::TypeDesc::UINT8, 3, std::vector<std::uint8_t>(30000, 77));
  const auto image = opened(std::make_shared<const std::vector<std::byte>>(whole->begin(), whole->begin() + 60));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->texels().width, 1U);
  EXPECT_NE(image->problem(), "");
}

TEST(ReadTexture, WhatIsNoImageIsRefused) {
  for (const std::string_view text : {"", "hello, hello, hello", "\x89PNG", "\xFF\xD8\xFF\xE0", "RIFF....WEBPVP8 "})
    EXPECT_NE(refusal(bytes_of(text)), "") << text;
}

}  // namespace
}  // namespace tessera
