#include "server/handlers/zip_archive.h"

#include <clocale>
#include <map>
#include <string>

#include <archive.h>
#include <archive_entry.h>
#include <gtest/gtest.h>

#include "proto/wire/abandoned.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

using proto::ProblemCode;

struct Entry {
  std::string name, content;
  mode_t type = AE_IFREG;
};

/// An archive that libarchive has written.
std::string zip(const std::vector<Entry>& entries) {
  std::string bytes(64 << 20, '\0');
  std::size_t used = 0;
  archive* writer = archive_write_new();
  archive_write_set_format_zip(writer);
  archive_write_open_memory(writer, bytes.data(), bytes.size(), &used);
  for (const Entry& each : entries) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, each.name.c_str());
    archive_entry_set_filetype(entry, each.type);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_size(entry, static_cast<la_int64_t>(each.content.size()));
    if (each.type == AE_IFLNK) archive_entry_set_symlink(entry, "/etc/passwd");
    archive_write_header(writer, entry);
    archive_write_data(writer, each.content.data(), each.content.size());
    archive_entry_free(entry);
  }
  archive_write_close(writer);
  archive_write_free(writer);
  bytes.resize(used);
  return bytes;
}

class Archive : public testing::Test {
 protected:
  proto::Result<std::vector<NamedFile>> unpack(std::string_view bytes, std::uint64_t most = 1 << 30,
                                               const std::stop_token& stop = {}) {
    return unpack_zip(
        bytes, most, [&] { return std::make_shared<ReceivedFile>(folder_.path()); }, stop);
  }

  ProblemCode refusal(const std::vector<Entry>& entries, std::uint64_t most = 1 << 30) {
    const std::string bytes = zip(entries);
    const auto files = unpack(bytes, most);
    EXPECT_FALSE(files);
    return files ? ProblemCode::internal_error : files.problem().code;
  }

  TemporaryFolder folder_;
};

TEST_F(Archive, HoldsFiles) {
  const std::string large(1 << 20, 'x');
  const auto files = unpack(zip({{"a.obj", "v"},
                                 {"b/", "", AE_IFDIR},
                                 {"./b//c.mtl", large},
                                 {"d", ""},
                                 {"e\\F.PNG", "p"},
                                 {"__MACOSX/._a.obj", "?"},
                                 {"b/.DS_Store", "?"}}));
  ASSERT_TRUE(files) << files.problem().detail;
  std::map<std::string, std::string> contents;
  for (const NamedFile& file : *files) contents[file.name] = file.file->content();
  EXPECT_EQ(contents,
            (std::map<std::string, std::string>{{"a.obj", "v"}, {"b/c.mtl", large}, {"d", ""}, {"e/F.PNG", "p"}}));
  EXPECT_FALSE(unpack(zip({}))) << "which libarchive takes for none";
}

TEST_F(Archive, NothingLeavesItsFolder) {
  for (const char* name : {"/etc/passwd", "../a", "a/../../b", "a/..", "C:/a", "..\\a", "a\nb"})
    EXPECT_EQ(refusal({{name, "x"}}), ProblemCode::malformed_request) << name;
  EXPECT_EQ(refusal({{std::string(2000, 'a'), "x"}}), ProblemCode::malformed_request);
  EXPECT_EQ(refusal({{"a", "", AE_IFLNK}}), ProblemCode::malformed_request);
  EXPECT_EQ(refusal({{"a", "x"}, {"./a", "y"}}), ProblemCode::malformed_request);
  EXPECT_EQ(folder_.file_count(), 0U);
}

TEST_F(Archive, WhatGrowsTooLargeIsNotUnpacked) {
  const std::string zeros(40 << 20, '\0');
  EXPECT_EQ(refusal({{"zeros", zeros}}), ProblemCode::payload_too_large) << "1000 times as large as the archive";
  const std::vector<Entry> two{{"a", std::string(600, 'a')}, {"b", std::string(600, 'b')}};
  EXPECT_EQ(refusal(two, 1000), ProblemCode::payload_too_large);
  EXPECT_TRUE(unpack(zip(two), 1200));
  EXPECT_EQ(refusal(std::vector<Entry>(kMostFiles + 1, {"a/", "", AE_IFDIR})), ProblemCode::payload_too_large);
  EXPECT_EQ(folder_.file_count(), 0U);
}

TEST_F(Archive, WhatIsBrokenIsRefused) {
  const std::string good = zip({{"a.obj", std::string(3000, 'v')}, {"b", "some text that isn't repeated"}});
  EXPECT_FALSE(unpack(""));
  EXPECT_FALSE(unpack("PK\x03\x04"));
  for (std::size_t size = 0; size < good.size(); size += 7) EXPECT_FALSE(unpack(good.substr(0, size))) << size;
  // Whatever a byte says, it ends, and all is well or refused.
  for (std::size_t at = 0; at < good.size(); ++at)
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string bad = good;
      bad[at] = static_cast<char>(bad[at] ^ flip);
      const auto files = unpack(bad);
      if (!files) continue;
      for (const NamedFile& file : *files) EXPECT_LE(file.file->size(), 3000U);
    }
}

// As Python's zipfile writes them.
constexpr std::string_view kBzip2(
    "PK\003\004.\000\000\000\014\000.c~]\322\026\221y1\000\000\000\030\000\000\000\005\000\000\000a.objBZ"
    "h91AY&SY\210a\364\370\000\000\013\330\200\000\020@\000@\000\001\000 \0000\3154\021G\247\2412\023\205"
    "\334\221N\024$\042\030}>\000PK\001\002.\003.\000\000\000\014\000.c~]\322\026\221y1\000\000\000\030"
    "\000\000\000\005\000\000\000\000\000\000\000\000\000\000\000\200\001\000\000\000\000a.objPK\005\006"
    "\000\000\000\000\001\000\001\0003\000\000\000T\000\000\000\000\000",
    157);
constexpr std::string_view kLzma(
    "PK\003\004?\000\002\000\016\000.c~]\322\026\221y\033\000\000\000\030\000\000\000\005\000\000\000a.ob"
    "j\011\004\005\000]\000\000\200\000\000;\010\002\021\002\012\254\314\237|\037\377\377\010<\000\000PK"
    "\001\002?\003?\000\002\000\016\000.c~]\322\026\221y\033\000\000\000\030\000\000\000\005\000\000\000"
    "\000\000\000\000\000\000\000\000\200\001\000\000\000\000a.objPK\005\006\000\000\000\000\001\000\001"
    "\0003\000\000\000>\000\000\000\000\000",
    135);
constexpr std::string_view kAccent(
    "PK\003\004\024\000\000\010\000\000.c~]\203\026\334\214\001\000\000\000\001\000\000\000\006\000\000"
    "\000\303\251.glbxPK\001\002\024\003\024\000\000\010\000\000.c~]\203\026\334\214\001\000\000\000\001"
    "\000\000\000\006\000\000\000\000\000\000\000\000\000\000\000\200\001\000\000\000\000\303\251.glbPK"
    "\005\006\000\000\000\000\001\000\001\0004\000\000\000%\000\000\000\000\000",
    111);

TEST_F(Archive, MethodsWhoseMemoryIsntBoundedAreRefused) {
  for (const std::string_view bytes : {kBzip2, kLzma}) {
    const auto files = unpack(bytes);
    ASSERT_FALSE(files);
    EXPECT_EQ(files.problem().code, ProblemCode::malformed_request);
    EXPECT_NE(files.problem().detail.find("\"a.obj\" isn't stored or compressed by deflate"), std::string::npos)
        << files.problem().detail;
  }
}

TEST_F(Archive, NamesInUtf8AreReadInEveryLocale) {
  ASSERT_STREQ(std::setlocale(LC_ALL, nullptr), "C");
  const auto files = unpack(kAccent);
  ASSERT_TRUE(files) << files.problem().detail;
  EXPECT_EQ(files->at(0).name, "\xC3\xA9.glb");
}

TEST_F(Archive, ManySmallFilesGoToTheDisk) {
  const std::size_t size = ReceivedFile::kMostInMemory;
  std::vector<Entry> entries;
  for (int i = 0; i < 40; ++i)
    entries.push_back({std::to_string(i), std::string(size, static_cast<char>('a' + i % 26))});
  const auto files = unpack(zip(entries));
  ASSERT_TRUE(files);
  std::size_t in_memory = 0;
  for (std::size_t i = 0; i < files->size(); ++i) {
    in_memory += (*files)[i].file->bytes_in_memory();
    EXPECT_EQ((*files)[i].file->content(), entries[i].content);
    EXPECT_EQ((*files)[i].file->finish(), proto::content_hash(entries[i].content));
  }
  EXPECT_GT(in_memory, 0U);
  EXPECT_LE(in_memory, MemoryOfFiles::kMost);
}

TEST_F(Archive, StopsWhenNobodyWaits) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(unpack(zip({{"a", "x"}}), 1000, stop.get_token()), proto::Abandoned);
}

TEST(UnsafeNames, AreTold) {
  for (const char* name : {"a", "a/b.c", ".a", "a..b", "...", "./a", "\xC3\xA4"})
    EXPECT_EQ(why_unsafe(name), "") << name;
  for (const char* name : {"", "/", "/a", "..", "a/..", "../a", "a/../b", "c:a", "a\\b", "a\tb", "a\x7F", "\xE4.png"})
    EXPECT_NE(why_unsafe(name), "") << name;
}

}  // namespace
}  // namespace tessera::server
