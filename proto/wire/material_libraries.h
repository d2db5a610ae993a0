#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace tessera::proto {

/// Whether an OBJ statement's keyword is mtllib, in any case.
bool is_mtllib(std::string_view keyword);

/// The keywords of an OBJ file's statements that name libraries, in lower case.
inline constexpr std::string_view kLibraryKeywords[] = {"mtllib"};

/// Finds an OBJ or MTL file's statements of some keywords in text that comes in pieces of any size: lines end as on any
/// system, a backslash at the end continues one, comments and a byte order mark count for nothing. Holds no more of the
/// text than one such statement.
class StatementScanner {
 public:
  /// Takes the keyword as it is written, and what follows it from the first blank on, with a blank for each character
  /// of what continues a line.
  using Tell = std::function<void(std::string_view keyword, std::string_view arguments)>;

  /// The keywords are in lower case, and outlive the scanner; they are found in any case.
  StatementScanner(std::span<const std::string_view> keywords, Tell tell)
      : keywords_(keywords), tell_(std::move(tell)) {}

  void feed(std::string_view piece);

  /// Ends the last line, which needn't have an end of its own.
  void finish();

 private:
  enum class Place { start, statement, rest };

  std::size_t take_rest(std::string_view piece);
  void take(char c);
  void take_of_statement(char c);
  void end_line();
  void end_statement();
  bool is_keyword(std::string_view word) const;

  std::span<const std::string_view> keywords_;
  Tell tell_;
  Place place_ = Place::start;
  std::size_t passed_ = 0;      ///< Bytes of a byte order mark, or as many as it has.
  std::string statement_;       ///< From the keyword on, as long as that may be one of ours.
  bool is_ours_ = false;        ///< Whether it begins with a keyword.
  char last_ = '\0';            ///< The line's last character other than a blank.
  bool has_backslash_ = false;  ///< At the start, where it may be all that the line holds.
  bool is_continued_ = false;   ///< Whether this line continues the one before; then it is no comment.
  bool is_comment_ = false;     ///< Comments aren't continued.
  bool is_after_cr_ = false;    ///< A line feed here belongs to the end before it.
};

/// Names of files, each of which is asked for once.
class AskedNames {
 public:
  /// Takes the file of that name if there is one, and says whether.
  using Take = std::function<bool(const std::string& name)>;

  /// Beyond `most` names nothing is asked for.
  AskedNames(Take take, std::size_t most) : take_(std::move(take)), most_(most) {}

  bool take(const std::string& name);

 private:
  Take take_;
  std::size_t most_;
  std::map<std::string, bool> asked_;  ///< And whether it was there.
};

/// A name with slashes for backslashes, of which one before a blank only protects it.
std::string with_slashes(std::string_view name);

/// Looks for the libraries that an OBJ file's mtllib statements name. Names are written in many ways: with blanks in
/// them, in quotes, with backslashes, behind a comment, with the folders of the machine that wrote them. Who looks
/// into the same files finds the same ones, in the same order.
class LibrarySearch {
 public:
  /// Beyond so many names nothing is looked for.
  static constexpr std::size_t kMostNames = 1024;

  /// `take` is asked for names relative to the OBJ file's folder, unless they begin with a slash; they may climb out of
  /// there with "..": whether that is allowed is for the asked to say.
  explicit LibrarySearch(AskedNames::Take take) : names_(std::move(take), kMostNames) {}

  /// Looks for what one statement names. False when something of it isn't there, or it names nothing.
  ///
  /// All of it may be one name. Else a name is what stands in quotes, or as many words as make one that is there, the
  /// most of them first, up to a word that ends in .mtl. A name is looked for with slashes for backslashes (a backslash
  /// before a blank only protects it), without needless dots at first, then as it is written; where no words make one
  /// that is there so, without its folders.
  bool look_for(std::string_view arguments);

 private:
  struct Word {
    std::string_view text;
    bool is_quoted = false;
  };
  static bool next_word(std::string_view& rest, Word& word);

  std::size_t take_words(std::string_view arguments, const Word* begin, const Word* end);
  bool take_as_written(std::string_view name);
  bool take_without_folders(std::string_view name);

  AskedNames names_;
};

}  // namespace tessera::proto
