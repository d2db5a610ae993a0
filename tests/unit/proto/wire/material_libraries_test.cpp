#include "proto/wire/material_libraries.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

using Names = std::vector<std::string>;

/// What a scanner tells of `text` that comes in pieces of `size`.
Names statements_in(const std::string& text, std::size_t size = std::string::npos) {
  Names statements;
  StatementScanner scanner(kLibraryKeywords,
                           [&](std::string_view, std::string_view arguments) { statements.emplace_back(arguments); });
  for (std::size_t at = 0; at < text.size(); at += std::min(size, text.size() - at))
    scanner.feed(std::string_view(text).substr(at, size));
  scanner.finish();
  return statements;
}

TEST(StatementScanner, FindsStatementsWhereverPiecesEnd) {
  const std::pair<std::string, Names> texts[] = {
      {"mtllib a.mtl\nv 0 0 0\nmtllib b.mtl", {" a.mtl", " b.mtl"}},
      {"\xEF\xBB\xBFmtllib a.mtl\n", {" a.mtl"}},
      {"v 1 2 3\r\n \tMTLLIB\ta.mtl\r\nMtlLib b.mtl\rv 1 2 3\r", {"\ta.mtl", " b.mtl"}},
      {"mtllib \\\n  a.mtl \\\r\nb.mtl\nmtllib c\\\rd", {"     a.mtl    b.mtl", " c  d"}},
      {"# mtllib no.mtl\n#\\\nmtllib a.mtl\n", {" a.mtl"}},
      {"g x \\\nmtllib no.mtl\nmtllib a.mtl\n", {" a.mtl"}},
      {"g x \\\n# y \\\r\nmtllib no.mtl\n", {}},
      {"\\\nmtllib a.mtl\n\\ \r\n# x \\\nmtllib no.mtl\n\\x\\\nmtllib no.mtl", {" a.mtl"}},
      {"mtllibx a\nxmtllib b\nmtl lib c\nmtl\\\nlib d\nusemtl e\nm\n", {}},
      {"mtllib", {""}},
      {"mtllib a\\b.mtl\\", {" a\\b.mtl\\"}},
      {"\n\r\r\n\nmtllib a.mtl # b", {" a.mtl # b"}},
      {"", {}},
  };
  for (const auto& [text, statements] : texts)
    for (const std::size_t size : {1U, 2U, 3U, 5U, 1000U})
      EXPECT_EQ(statements_in(text, size), statements) << text << ", by " << size;
}

TEST(StatementScanner, HoldsNoLineThatIsNoneOfItsOwn) {
  Names statements;
  StatementScanner scanner(kLibraryKeywords,
                           [&](std::string_view, std::string_view arguments) { statements.emplace_back(arguments); });
  const std::string piece(1 << 20, 'm');
  for (int i = 0; i < 3; ++i) scanner.feed(piece);
  scanner.feed("\nmtllib ");
  for (int i = 0; i < 3; ++i) scanner.feed(piece);
  scanner.feed("\nmtllib a");
  scanner.finish();
  ASSERT_EQ(statements.size(), 2U);
  EXPECT_LE(statements[0].size(), piece.size());
  EXPECT_EQ(statements[1], " a");
}

/// What is taken where `there` are the files that are there.
Names found(const std::string& arguments, const std::set<std::string>& there, bool all = true) {
  Names taken;
  LibrarySearch search([&](const std::string& name) {
    if (!there.contains(name)) return false;
    taken.push_back(name);
    return true;
  });
  EXPECT_EQ(search.look_for(arguments), all) << arguments;
  return taken;
}

TEST(LibrarySearch, TakesNamesWithBlanks) {
  EXPECT_EQ(found(" my mat.mtl ", {"my mat.mtl"}), (Names{"my mat.mtl"}));
  EXPECT_EQ(found("a.mtl my  mat.mtl\tb.mtl", {"a.mtl", "my  mat.mtl", "b.mtl"}),
            (Names{"a.mtl", "my  mat.mtl", "b.mtl"}));
  EXPECT_EQ(found("my\\ mat.mtl", {"my mat.mtl"}), (Names{"my mat.mtl"}));
  EXPECT_EQ(found("a b c", {"a", "b c"}), (Names{"a", "b c"}));
  EXPECT_EQ(found("a.mtl b.mtl", {"a.mtl b.mtl", "a.mtl", "b.mtl"}), (Names{"a.mtl b.mtl"}));
}

TEST(LibrarySearch, TakesNamesInQuotes) {
  EXPECT_EQ(found("\"my mat.mtl\"", {"my mat.mtl"}), (Names{"my mat.mtl"}));
  EXPECT_EQ(found("'my mat.mtl' \"b.mtl\" c.mtl", {"my mat.mtl", "b.mtl", "c.mtl"}),
            (Names{"my mat.mtl", "b.mtl", "c.mtl"}));
  EXPECT_EQ(found("\"C:\\my mats\\a b.mtl\"", {"a b.mtl"}), (Names{"a b.mtl"}));
  EXPECT_EQ(found("bob's.mtl 'tis.mtl", {"bob's.mtl", "'tis.mtl"}), (Names{"bob's.mtl", "'tis.mtl"}));
  EXPECT_EQ(found("\"my mat.mtl\"", {"my", "mat.mtl"}, false), Names{}) << "one name, not two";
}

TEST(LibrarySearch, TakesFoldersOfEverySystem) {
  EXPECT_EQ(found("sub\\plain.mtl", {"sub/plain.mtl"}), (Names{"sub/plain.mtl"}));
  EXPECT_EQ(found("sub\\plain.mtl", {"sub\\plain.mtl"}), (Names{"sub\\plain.mtl"})) << "as bad unpackers name files";
  EXPECT_EQ(found("./a.mtl", {"a.mtl"}), (Names{"a.mtl"}));
  EXPECT_EQ(found("./a.mtl", {"./a.mtl"}), (Names{"./a.mtl"})) << "as a sender may have named it";
  EXPECT_EQ(found(".\\x//y\\..\\a.mtl", {"x/a.mtl"}), (Names{"x/a.mtl"}));
  EXPECT_EQ(found("../a.mtl", {"../a.mtl", "a.mtl"}), (Names{"../a.mtl"}));
}

TEST(LibrarySearch, FallsBackToTheNameWithoutFolders) {
  for (const char* written : {"C:\\Users\\bob\\model.mtl", "/home/bob/model.mtl", "C:\\Users\\bob smith\\model.mtl",
                              "\\\\server\\share\\model.mtl", "file:///home/bob/model.mtl", "../../model.mtl",
                              "sub/model.mtl", "\"/home/b ob/model.mtl\""})
    EXPECT_EQ(found(written, {"model.mtl"}), (Names{"model.mtl"})) << written;
  EXPECT_EQ(found("/x/a.mtl C:\\y\\b.mtl", {"a.mtl", "b.mtl"}), (Names{"a.mtl", "b.mtl"}));
  EXPECT_EQ(found("/x/a.mtl", {"/x/a.mtl", "a.mtl"}), (Names{"/x/a.mtl"})) << "where it is allowed";
}

TEST(LibrarySearch, EndsAtAComment) {
  EXPECT_EQ(found("a.mtl # b.mtl", {"a.mtl", "b.mtl"}), (Names{"a.mtl"}));
  EXPECT_EQ(found("a #2.mtl", {"a #2.mtl"}), (Names{"a #2.mtl"}));
  EXPECT_EQ(found("#1.mtl", {"#1.mtl"}), (Names{"#1.mtl"}));
}

TEST(LibrarySearch, SaysWhatIsMissing) {
  EXPECT_EQ(found("a.mtl b.mtl c.mtl", {"a.mtl", "c.mtl"}, false), (Names{"a.mtl", "c.mtl"}));
  EXPECT_EQ(found("", {""}, false), Names{});
  EXPECT_EQ(found(" \t", {""}, false), Names{});
  EXPECT_EQ(found(std::string(10000, 'a'), {std::string(10000, 'a')}, false), Names{});
}

TEST(LibrarySearch, AsksForANameOnce) {
  Names asked;
  LibrarySearch search([&](const std::string& name) { return asked.push_back(name), name == "a.mtl"; });
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(search.look_for("a.mtl"));
    EXPECT_TRUE(search.look_for("./a.mtl"));
    EXPECT_FALSE(search.look_for("b.mtl"));
  }
  EXPECT_EQ(asked, (Names{"a.mtl", "b.mtl"}));
}

TEST(LibrarySearch, GivesUpInTheEnd) {
  std::size_t asked = 0;
  LibrarySearch search([&](const std::string&) { return ++asked, false; });
  std::string words;
  for (int i = 0; i < 2000; ++i) words += " w" + std::to_string(i);
  EXPECT_FALSE(search.look_for(words));
  EXPECT_LE(asked, LibrarySearch::kMostNames);
}

TEST(LibrarySearch, TakesHundreds) {
  std::string words;
  std::set<std::string> there;
  for (int i = 0; i < 500; ++i) {
    there.insert("m" + std::to_string(i) + ".mtl");
    words += " m" + std::to_string(i) + ".mtl";
  }
  EXPECT_EQ(found(words, there).size(), there.size());
}

}  // namespace
}  // namespace tessera::proto
