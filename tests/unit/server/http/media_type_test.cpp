#include "server/http/media_type.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

TEST(MediaType, IgnoresParametersAndCase) {
  EXPECT_TRUE(is_media_type("application/json", "application/json"));
  EXPECT_TRUE(is_media_type("Application/JSON ; charset=utf-8", "application/json"));
  EXPECT_FALSE(is_media_type("application/json5", "application/json"));
  EXPECT_FALSE(is_media_type("", "application/json"));
}

TEST(Acceptance, TheMostSpecificRangeDecides) {
  const char* accept = "image/*;q=0.5, image/png;q=0.1, */*;q=0.8";
  EXPECT_DOUBLE_EQ(acceptance(accept, "image/png"), 0.1);
  EXPECT_DOUBLE_EQ(acceptance(accept, "image/jpeg"), 0.5);
  EXPECT_DOUBLE_EQ(acceptance(accept, "text/plain"), 0.8);
  EXPECT_DOUBLE_EQ(acceptance("image/png;q=0, */*", "image/png"), 0);
}

TEST(Acceptance, WithoutAWeightIsOne) {
  EXPECT_DOUBLE_EQ(acceptance("IMAGE/PNG", "image/png"), 1);
  EXPECT_DOUBLE_EQ(acceptance("image/png;level=1", "image/png"), 1);
  EXPECT_DOUBLE_EQ(acceptance("image/png ; level=1 ; Q=0.25", "image/png"), 0.25);
}

TEST(Acceptance, WhatCannotBeReadCountsForNothing) {
  for (const char* accept : {"", ",", ";", "image", "image/", "/png", "image/png;q=", "image/png;q=2", "image/png;q=-1",
                             "image/png;q=nan", "image/png;q=1x", "imag/*", "image/pn*"})
    EXPECT_DOUBLE_EQ(acceptance(accept, "image/png"), 0) << accept;
}

}  // namespace
}  // namespace tessera::server
