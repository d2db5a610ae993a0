#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/import_checks.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kMutations = 10'000;

std::vector<std::string> corpus(const std::string& target) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(fs::path(TESSERA_SOURCE_DIR) / "tests/fuzz/corpus" / target)) {
    paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> files;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return files;
}

/// Changes, takes out, repeats and swaps in a few bytes, numbers and pieces of another file.
std::string mutated(const std::vector<std::string>& files, unsigned seed) {
  static const std::vector<std::string> kTokens{"0",
                                                "-1",
                                                "1e39",
                                                "nan",
                                                "4294967295",
                                                "2147483648",
                                                "\n",
                                                " ",
                                                "/",
                                                "#",
                                                "\\\n",
                                                "-inf",
                                                "1e-50",
                                                "\r",
                                                "v ",
                                                "f ",
                                                "3.5",
                                                "0x1",
                                                "list ",
                                                "99999999999999999999",
                                                std::string(1, '\0')};
  std::mt19937 random(seed);
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  std::string bytes = files[below(files.size())];
  for (std::size_t changes = 1 + below(6); changes > 0; --changes) {
    const std::size_t at = below(bytes.size() + 1);
    const std::size_t length = std::min(below(12), bytes.size() - at);
    switch (below(6)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes.erase(at, length);
        break;
      case 2:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 3:
        bytes.replace(at, length, kTokens[below(kTokens.size())]);
        break;
      case 4:
        bytes.resize(at);
        break;
      case 5: {
        const std::string& other = files[below(files.size())];
        bytes.insert(at, other.substr(below(other.size()), below(40)));
        break;
      }
    }
  }
  return bytes;
}

void expect_no_faults(const std::string& target, FileFormat format) {
  const std::vector<std::string> files = corpus(target);
  const OwnLibrary library;
  ASSERT_FALSE(files.empty());
  for (unsigned seed = 0; seed < kMutations; ++seed) {
    const std::string bytes = mutated(files, seed);
    const std::string fault = fault_of_reading(format, bytes, library.of(bytes));
    ASSERT_EQ(fault, "") << "seed " << seed << ":\n" << bytes;
  }
}

TEST(ImportMutations, NffIsImportedOrRefused) { expect_no_faults("import_nff", FileFormat::nff); }
TEST(ImportMutations, ObjIsImportedOrRefused) { expect_no_faults("import_obj", FileFormat::obj); }
TEST(ImportMutations, PlyIsImportedOrRefused) { expect_no_faults("import_ply", FileFormat::ply); }
TEST(ImportMutations, StlIsImportedOrRefused) { expect_no_faults("import_stl", FileFormat::stl); }

}  // namespace
}  // namespace tessera::proto
