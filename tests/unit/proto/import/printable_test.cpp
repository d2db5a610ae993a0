#include "proto/import/printable.h"

#include <string>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

TEST(Printable, KeepsUtf8) {
  for (const char* text : {"", "plain", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
                           "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, MarksEveryByteThatIsNone) {
  EXPECT_EQ(printable(std::string("a\0b\n\x7F\t", 6)), "a?b???");
  EXPECT_EQ(printable("\x80"), "?");
  EXPECT_EQ(printable("\xC0\x80"), "??") << "a longer form than needed";
  EXPECT_EQ(printable("\xE0\x9F\xBF"), "???");
  EXPECT_EQ(printable("\xED\xA0\x80"), "???") << "half of a UTF-16 pair";
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "????") << "beyond U+10FFFF";
  EXPECT_EQ(printable("\xF8\x80\x80\x80\x80"), "?????");
  EXPECT_EQ(printable("\xE2\x82"), "??") << "cut off";
  EXPECT_EQ(printable("\xE2\x82x"), "??x");
}

}  // namespace
}  // namespace tessera::proto
