#include "client/columns.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

TEST(Columns, CountWhatATerminalShows) {
  EXPECT_EQ(columns_of(""), 0U);
  EXPECT_EQ(columns_of("plain"), 5U);
  EXPECT_EQ(columns_of("\u00E4\u0416"), 2U);
  EXPECT_EQ(columns_of("\u65E5\u672C\u8A9E"), 6U) << "wide";
  EXPECT_EQ(columns_of("\uD55C\uFF21"), 4U);
  EXPECT_EQ(columns_of("e\u0301"), 1U) << "a mark stands on its letter";
  EXPECT_EQ(columns_of("\U0001F680x"), 3U);
}

TEST(Columns, AreFilledWithBlanks) {
  EXPECT_EQ(padded("\u65E5", 4), "\u65E5  ");
  EXPECT_EQ(flush_right("e\u0301", 3), "  e\u0301");
  EXPECT_EQ(padded("longer", 3), "longer");
}

}  // namespace
}  // namespace tessera::client
