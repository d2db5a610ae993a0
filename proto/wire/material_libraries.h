#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace tessera::proto {

/// Whether an OBJ statement's keyword is mtllib, in any case.
bool is_mtllib(std::string_view keyword);

/// Finds an OBJ file's mtllib statements in text that comes in pieces of any size: lines end as on any system, a
/// backslash at the end continues one, comments and a byte order mark count for nothing. Holds no more of the text than
/// one such statement.
class MtllibScanner {
 public:
  /// Takes what follows the keyword, from the first blank on, with a blank for each character of what continues a line.
  using Tell = std::function<void(std::string_view arguments)>;
  explicit MtllibScanner(Tell tell) : tell_(std::move(tell)) {}

  void feed(std::string_view piece);

  /// Ends the last line, which needn't have an end of its own.
  void finish();

 private:
  enum class Place { start, statement, rest };

  std::size_t take_rest(std::string_view piece);
  void take(char c);
  void end_line();
  void end_statement();

  Tell tell_;
  Place place_ = Place::start;
  std::size_t passed_ = 0;      ///< Bytes of a byte order mark, or as many as it has.
  std::string statement_;       ///< From the keyword on, as long as that may be mtllib.
  char last_ = '\0';            ///< The line's last character other than a blank.
  bool has_backslash_ = false;  ///< At the start, where it may be all that the line holds.
  bool is_continued_ = false;   ///< Whether this line continues the one before; then it is no comment.
  bool is_comment_ = false;     ///< Comments aren't continued.
  bool is_after_cr_ = false;    ///< A line feed here belongs to the end before it.
};

/// Looks for the libraries that an OBJ file's mtllib statements name. Names are written in many ways: with blanks in
/// them, in quotes, with backslashes, behind a comment, with the folders of the machine that wrote them. Who looks
/// into the same files finds the same ones, in the same order.
class LibrarySearch {
 public:
  /// Beyond so many names nothing is looked for.
  static constexpr std::size_t kMostNames = 1024;

  /// Takes the library of that name if there is one, and says whether. It is asked once for every name, which is
  /// relative to the OBJ file's folder unless it begins with a slash, and may climb out of there with "..": whether
  /// that is allowed is for the asked to say.
  using Take = std::function<bool(const std::string& name)>;
  explicit LibrarySearch(Take take) : take_(std::move(take)) {}

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
  bool take(const std::string& name);

  Take take_;
  std::map<std::string, bool> looked_for_;  ///< And whether it was there.
};

}  // namespace tessera::proto
