#include "proto/wire/printable.h"

#include <string>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

TEST(Printable, KeepsUtf8) {
  for (const char* text : {"", "plain", "\xC2\xA0", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
                           "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, MarksWhatActsOnATerminal) {
  EXPECT_EQ(printable("a\x1B[31mred"), "a?[31mred");
  EXPECT_EQ(printable("\xC2\x80|\xC2\x9B"
                      "31m|\xC2\x9F"),
            "?|?31m|?")
      << "C1, of which U+009B is an ESC [";
  EXPECT_EQ(printable("\u202Egnp.\u202C \u2066x\u2069"), "?gnp.? ?x?") << "turns the direction";
  EXPECT_EQ(printable("a\u2028b\u2029c"), "a?b?c") << "separators of lines and paragraphs";
  EXPECT_EQ(printable("\uFEFFa\u200Bb\u2060"
                      "c\U000E0041"),
            "?a?b?c?")
      << "takes no room";
}

TEST(Printable, KeepsWhatWordsNeed) {
  for (const char* text : {"\u0646\u0645\u06CC\u200C\u062E\u0648\u0627\u0647\u0645", "e\u0301", "\u65E5\u672C",
                           "\U0001F469\u200D\U0001F680"})
    EXPECT_EQ(printable(text), text);
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
