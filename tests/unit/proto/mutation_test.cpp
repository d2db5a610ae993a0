#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/document_checks.h"

namespace tessera {
namespace {

constexpr int kMutants = 20000;

std::vector<std::string> documents() {
  std::vector<std::filesystem::path> paths;
  for (const char* folder : {"good", "bad"}) {
    const auto path = std::filesystem::path(TESSERA_SOURCE_DIR) / "tests/data/documents" / folder;
    for (const auto& entry : std::filesystem::directory_iterator(path)) paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  std::vector<std::string> texts;
  for (const auto& path : paths) {
    std::ifstream file(path, std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return texts;
}

/// A document with a few of its bytes, or a run of them, replaced, removed or doubled.
std::string mutant(const std::vector<std::string>& originals, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  static const std::vector<std::string> kPieces{"null", "-1",   "1e39", "1e400", "0", "[]",     "{}",   "\"\"",
                                                "true", "\xFF", ",",    "]",     "}", "[[[[[[", "1e17", "4294967295"};
  std::string text = originals[below(originals.size())];
  for (std::size_t edits = 1 + below(3); edits > 0 && !text.empty(); --edits) {
    const std::size_t at = below(text.size());
    const std::size_t size = below(std::min<std::size_t>(20, text.size() - at)) + 1;
    switch (below(4)) {
      case 0:
        text.erase(at, size);
        break;
      case 1:
        text.insert(at, text.substr(at, size));
        break;
      case 2:
        text.replace(at, size, kPieces[below(kPieces.size())]);
        break;
      default:
        text[at] = static_cast<char>(below(256));
        break;
    }
  }
  return text;
}

TEST(Mutations, NoDocumentBringsTheParserDownOrGivesABrokenScene) {
  const auto originals = documents();
  ASSERT_FALSE(originals.empty());
  for (int seed = 0; seed < kMutants; ++seed) {
    std::mt19937 random(seed);
    const std::string text = mutant(originals, random);
    ASSERT_EQ(fault_of_scene_document(text), "") << "seed " << seed << ": " << text;
    ASSERT_EQ(fault_of_job_document(text), "") << "seed " << seed << ": " << text;
  }
}

}  // namespace
}  // namespace tessera
