#include "server/handlers/image_choice.h"

#include <gtest/gtest.h>

#include "proto/names.h"

namespace tessera::server {
namespace {

using proto::ProblemCode;

proto::Result<ImageChoice> choose(const std::string& query, const std::set<Aov>& recorded = {},
                                  const std::string& accept = "") {
  Request request;
  request.target = *parse_target("/?" + query);
  if (!accept.empty()) request.headers["accept"] = accept;
  Settings settings;
  settings.aovs = recorded;
  return choose_image(request, settings);
}

TEST(ImageChoice, IsThePngOfTheColourUnlessAsked) {
  const auto choice = choose("");
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->plane, kColorPlane);
  EXPECT_EQ(choice->format.format, ImageFormat::png);
  EXPECT_FALSE(choice->partial);
  EXPECT_TRUE(choose("partial=1")->partial);
  EXPECT_EQ(choose("partial=yes").problem().code, ProblemCode::malformed_request);
  EXPECT_EQ(choose("aov=colour&format=gif&partial=yes").problem().errors.size(), 3U);
}

TEST(ImageChoice, FormatOverridesAccept) {
  EXPECT_EQ(choose("", {}, "image/x-exr")->format.format, ImageFormat::exr);
  EXPECT_EQ(choose("format=hdr", {}, "image/x-exr")->format.format, ImageFormat::hdr);
  EXPECT_EQ(choose("format=hdr", {}, "text/html")->format.format, ImageFormat::hdr);
  EXPECT_EQ(choose("", {}, "text/html").problem().code, ProblemCode::not_acceptable);
  EXPECT_EQ(choose("", {}, "image/png;q=0.2, image/jpeg;q=0.3")->format.format, ImageFormat::jpeg);
  EXPECT_EQ(choose("format=gif").problem().code, ProblemCode::malformed_request);
}

TEST(ImageChoice, AnAovHasToBeRecorded) {
  EXPECT_EQ(choose("aov=depth", {Aov::depth})->plane, Plane{Aov::depth});
  EXPECT_EQ(choose("aov=depth", {Aov::normal}).problem().code, ProblemCode::not_found);
  EXPECT_EQ(choose("aov=all")->plane, kAllPlanes);
  EXPECT_EQ(choose("aov=").problem().code, ProblemCode::malformed_request);
  EXPECT_EQ(choose("aov=colour").problem().code, ProblemCode::malformed_request);
}

TEST(ImageChoice, NotEveryFormatHoldsEveryPlane) {
  EXPECT_EQ(choose("aov=all")->format.format, ImageFormat::exr);
  EXPECT_EQ(choose("aov=all&format=png").problem().code, ProblemCode::not_acceptable);
  EXPECT_EQ(choose("aov=depth", {Aov::depth}, "image/vnd.radiance").problem().code, ProblemCode::not_acceptable);
  EXPECT_EQ(choose("aov=normal&format=hdr", {Aov::normal}).problem().code, ProblemCode::not_acceptable)
      << "normals can be negative";
  EXPECT_EQ(choose("aov=cost_volumes&format=hdr", {Aov::cost_volumes})->format.format, ImageFormat::hdr);
}

proto::Result<ImageChoice> choose_of_size(std::uint32_t width, std::uint32_t height, const std::string& query) {
  Request request;
  request.target = *parse_target("/?" + query);
  Settings settings;
  settings.width = width;
  settings.height = height;
  return choose_image(request, settings);
}

TEST(ImageChoice, NotEveryFormatHoldsEverySize) {
  EXPECT_TRUE(choose_of_size(65500, 1, "format=jpeg"));
  EXPECT_TRUE(choose_of_size(1, 65500, "format=jpeg"));
  for (const auto& [width, height] : {std::pair(65501U, 1U), std::pair(1U, 65501U)}) {
    const auto refused = choose_of_size(width, height, "format=jpeg");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.problem().code, ProblemCode::not_acceptable);
    EXPECT_NE(refused.problem().detail.find("png (image/png), exr (image/x-exr), hdr"), std::string::npos);
    EXPECT_EQ(refused.problem().detail.find("jpeg"), std::string::npos);
    EXPECT_EQ(choose_of_size(width, height, "")->format.format, ImageFormat::png);
  }
  EXPECT_TRUE(choose_of_size(1U << 26, 1, "format=png"));
  Settings huge;
  huge.width = 0x7FFFFFFF;
  EXPECT_EQ(able_formats(kColorPlane, huge), "png (image/png), hdr (image/vnd.radiance)");
  huge.width = 0x80000000;
  EXPECT_EQ(able_formats(kColorPlane, huge), "");
}

TEST(ImageChoice, JpegHasAQuality) {
  const auto jpeg = [](const std::string& query) { return choose("format=jpeg&" + query)->encoding.jpeg; };
  EXPECT_EQ(jpeg("").quality, 95);
  EXPECT_EQ(jpeg("").subsampling, Subsampling::s444);
  EXPECT_EQ(jpeg("quality=90").subsampling, Subsampling::s444);
  EXPECT_EQ(jpeg("quality=89").quality, 89);
  EXPECT_EQ(jpeg("quality=89").subsampling, Subsampling::s420);
  EXPECT_EQ(jpeg("quality=1&subsampling=4:4:4").subsampling, Subsampling::s444);
  EXPECT_EQ(jpeg("quality=100&subsampling=4%3A2%3A2").subsampling, Subsampling::s422);
  EXPECT_EQ(jpeg("subsampling=4:2:0").subsampling, Subsampling::s420);
  EXPECT_EQ(choose("quality=50", {}, "image/jpeg")->encoding.jpeg.quality, 50);
}

TEST(ImageChoice, OnlyJpegHasIt) {
  const auto pointer = [](const std::string& query) {
    const auto refused = choose(query);
    if (refused) return std::string("taken");
    EXPECT_EQ(refused.problem().code, ProblemCode::malformed_request);
    return refused.problem().errors.at(0).pointer;
  };
  for (const char* value : {"0", "101", "-1", "95.5", "", "high", "1e2", "99999999999", "+5", "%205"})
    EXPECT_EQ(pointer("format=jpeg&quality=" + std::string(value)), "?quality") << value;
  for (const char* value : {"", "444", "4:1:1", "4:4:4:4"})
    EXPECT_EQ(pointer("format=jpeg&subsampling=" + std::string(value)), "?subsampling") << value;
  for (const char* format : {"png", "exr", "hdr"}) {
    EXPECT_EQ(pointer("quality=95&format=" + std::string(format)), "?quality");
    EXPECT_EQ(pointer("subsampling=4:4:4&format=" + std::string(format)), "?subsampling");
  }
  EXPECT_EQ(pointer("quality=95"), "?quality") << "what comes is a PNG";
  EXPECT_EQ(choose("quality=0&subsampling=no&format=jpeg").problem().errors.size(), 2U);
}

TEST(ImageChoice, ColourHasALook) {
  const auto look = [](const std::string& query) { return choose(query)->encoding.look; };
  EXPECT_EQ(look(""), Look());
  EXPECT_EQ(look("exposure=1.5&tone_map=aces"), (Look{1.5F, ToneMap::aces}));
  EXPECT_EQ(look("format=jpeg&exposure=-64"), (Look{-64, ToneMap::none}));
  EXPECT_EQ(look("tone_map=khronos_pbr_neutral&exposure=6.4e1"), (Look{64, ToneMap::khronos_pbr_neutral}));
  EXPECT_EQ(look("tone_map=none&exposure=0"), Look());
}

TEST(ImageChoice, WhatHasNoLookOrPrecisionRefusesIt) {
  const auto pointer = [](const std::string& query) {
    const auto refused = choose(query, {Aov::depth, Aov::albedo});
    if (refused) return std::string("taken");
    EXPECT_EQ(refused.problem().code, ProblemCode::malformed_request);
    return refused.problem().errors.at(0).pointer;
  };
  for (const char* value : {"", "bright", "64.1", "-65", "1e9", "inf", "nan", "1.5x", "%201", "1,5"})
    EXPECT_EQ(pointer("exposure=" + std::string(value)), "?exposure") << value;
  for (const char* value : {"", "ACES", "filmic"})
    EXPECT_EQ(pointer("tone_map=" + std::string(value)), "?tone_map") << value;
  for (const char* value : {"", "double", "16"})
    EXPECT_EQ(pointer("format=exr&precision=" + std::string(value)), "?precision") << value;
  for (const char* where : {"format=exr", "format=hdr", "aov=depth", "aov=albedo", "aov=all"}) {
    EXPECT_EQ(pointer(where + std::string("&exposure=0")), "?exposure") << where;
    EXPECT_EQ(pointer(where + std::string("&tone_map=none")), "?tone_map") << where;
  }
  for (const char* format : {"png", "jpeg", "hdr"})
    EXPECT_EQ(pointer("precision=float&format=" + std::string(format)), "?precision");
  EXPECT_EQ(pointer("format=exr&background=ffffff"), "?background");
  EXPECT_EQ(choose("precision=half&format=exr")->encoding.precision, Precision::half);
  EXPECT_EQ(choose("precision=half&aov=all")->encoding.precision, Precision::half);
  EXPECT_EQ(choose("format=exr")->encoding.precision, Precision::single);
}

/// The table of planes and the encoder agree on what can hold what.
TEST(ImageChoice, TheEncoderTakesWhatTheTablePromises) {
  std::set<Aov> aovs;
  for (const auto& choice : proto::aov_names()) aovs.insert(choice.value);
  const Pixels pixels({0, 0, 4, 4}, aovs);
  for (const PlaneEntry& plane : plane_table())
    for (const FormatEntry& format : format_table()) {
      const std::string query =
          "format=" + std::string(format.name) + (plane.name.empty() ? "" : "&aov=" + std::string(plane.name));
      EXPECT_EQ(encode(pixels, plane.plane, {.format = format.format}).has_value(), bool(choose(query, aovs))) << query;
    }
}

TEST(ImageChoice, ABackgroundIsOfWhatIsTransparent) {
  const auto choose_of = [](const std::string& query, bool transparent, const ImageDefaults& defaults = {}) {
    Request request;
    request.target = *parse_target("/?" + query);
    Settings settings;
    settings.transparent = transparent;
    if (transparent) settings.aovs = {Aov::alpha, Aov::depth};
    return choose_image(request, settings, defaults);
  };
  EXPECT_EQ(choose_of("background=FF0000", true)->encoding.background, (Rgb{1, 0, 0}));
  EXPECT_EQ(choose_of("background=%23ff0000&format=jpeg", true)->encoding.background, (Rgb{1, 0, 0}));
  EXPECT_EQ(choose_of("background=white", true)->encoding.background, (Rgb{1, 1, 1}));
  EXPECT_FALSE(choose_of("background=transparent", true)->encoding.background);
  EXPECT_FALSE(choose_of("", true)->encoding.background);
  const ImageDefaults white{ToneMap::aces, Rgb{1, 1, 1}};
  EXPECT_EQ(choose_of("", true, white)->encoding.background, (Rgb{1, 1, 1}));
  EXPECT_EQ(choose_of("", true, white)->encoding.look.tone_map, ToneMap::aces);
  EXPECT_FALSE(choose_of("background=transparent", true, white)->encoding.background);
  EXPECT_FALSE(choose_of("", false, white)->encoding.background);
  EXPECT_TRUE(choose_of("background=transparent&format=exr", true)) << "it is";
  EXPECT_FALSE(choose_of("background=transparent&format=jpeg", true)) << "it can't be";
  for (const char* other : {"format=exr", "aov=depth"}) {
    const auto choice = choose_of(other, true, white);
    EXPECT_FALSE(choice->encoding.background) << other;
    EXPECT_EQ(choice->encoding.look, Look()) << other;
    EXPECT_FALSE(choose_of(std::string(other) + "&background=ffffff", true)) << other;
  }
  for (const char* bad : {"fffff", "fffffff", "ffffff%20", "%2Bfffff", "0xffff", "pink", "", "%23", "-12345"})
    EXPECT_EQ(choose_of(std::string("background=") + bad, true).problem().errors.at(0).pointer, "?background") << bad;
  EXPECT_FALSE(choose_of("background=ffffff", false));
  EXPECT_TRUE(choose_of("background=environment", false));
  EXPECT_FALSE(choose_of("background=environment", true));
}

}  // namespace
}  // namespace tessera::server
