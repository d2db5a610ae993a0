#include "server/image_choice.h"

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
  return choose_image(request, recorded);
}

TEST(ImageChoice, IsThePngOfTheColourUnlessAsked) {
  const auto choice = choose("");
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->plane, Plane::color);
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
  EXPECT_EQ(choose("aov=depth", {Aov::depth})->plane, Plane::depth);
  EXPECT_EQ(choose("aov=depth", {Aov::normal}).problem().code, ProblemCode::not_found);
  EXPECT_EQ(choose("aov=all")->plane, Plane::all);
  EXPECT_EQ(choose("aov=").problem().code, ProblemCode::malformed_request);
  EXPECT_EQ(choose("aov=colour").problem().code, ProblemCode::malformed_request);
}

TEST(ImageChoice, NotEveryFormatHoldsEveryPlane) {
  EXPECT_EQ(choose("aov=all")->format.format, ImageFormat::exr);
  EXPECT_EQ(choose("aov=all&format=png").problem().code, ProblemCode::not_acceptable);
  EXPECT_EQ(choose("aov=depth", {Aov::depth}, "image/vnd.radiance").problem().code, ProblemCode::not_acceptable);
  EXPECT_EQ(choose("aov=normal&format=hdr", {Aov::normal})->format.format, ImageFormat::hdr);
}

/// The table of planes and the encoder agree on what can hold what.
TEST(ImageChoice, TheEncoderTakesWhatTheTablePromises) {
  std::set<Aov> aovs;
  for (const auto& choice : proto::aov_names()) aovs.insert(choice.value);
  const Pixels pixels({0, 0, 4, 4}, aovs);
  for (const PlaneEntry& plane : plane_table())
    for (const FormatEntry& format : format_table())
      EXPECT_EQ(encode(pixels, plane.plane, format.format).has_value(), plane.formats.contains(format.format))
          << plane.name << " as " << format.name;
}

}  // namespace
}  // namespace tessera::server
