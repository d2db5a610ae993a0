#include "server/store/wide_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "core/accel/wide/wide_build.h"
#include "proto/wire/sha256.h"
#include "server/store/file_descriptor.h"
#include "server/store/received_file.h"

namespace tessera::server {
namespace {

using HexHash = std::array<char, 64>;

/// What a file begins with; nodes and leaves follow.
struct alignas(64) Header {
  std::array<char, 8> magic;
  HexHash checksum;  ///< Of all that follows this.
  HexHash key;
  std::uint32_t byte_order;
  std::uint32_t depth;
  std::uint64_t nodes;  ///< `WideNode`s.
  std::uint64_t words;  ///< Of leaves.
  std::uint64_t leaves;
  Aabb root;
  std::array<char, 64> zeros;
};
static_assert(sizeof(Header) == 256 && offsetof(Header, zeros) + sizeof(Header::zeros) == sizeof(Header));

constexpr std::array kMagic{'t', 's', 'r', '-', 'w', 'i', 'd', 'e'};
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::size_t kUnhashed = offsetof(Header, key);

HexHash hex(proto::Sha256& sha256) {
  const proto::ContentHash hash = sha256.finish();
  HexHash digits;
  std::copy_n(hash.end() - digits.size(), digits.size(), digits.begin());
  return digits;
}

template <typename T>
std::span<const std::byte> bytes_of(const T& value) {
  return std::as_bytes(std::span(&value, 1));
}

HexHash checksum_of(const Header& header, std::span<const std::byte> nodes, std::span<const std::byte> leaves) {
  proto::Sha256 sha256;
  sha256.update(bytes_of(header).subspan(kUnhashed));
  sha256.update(nodes);
  sha256.update(leaves);
  return hex(sha256);
}

/// Memory for a whole file. Not the file itself, mapped: who writes into that, or cuts it short, would change what
/// rays are traced with, or end the process.
class FileMemory {
 public:
  explicit FileMemory(std::size_t size)
      : size_(size), data_(::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    if (data_ == MAP_FAILED) throw std::bad_alloc();
  }
  FileMemory(const FileMemory&) = delete;
  ~FileMemory() { ::munmap(data_, size_); }

  std::span<std::byte> bytes() const { return {static_cast<std::byte*>(data_), size_}; }

 private:
  std::size_t size_;
  void* data_;
};

void expect(bool holds, const char* otherwise) {
  if (!holds) throw DamagedFile(otherwise);
}

/// Fills `bytes` from the file's beginning; the checksum of what follows the header's own. Each piece is hashed while
/// it is at hand.
HexHash read_and_hash(const FileDescriptor& file, std::span<std::byte> bytes) {
  constexpr std::size_t kMostAtOnce = 1 << 20;
  proto::Sha256 sha256;
  for (std::size_t there = 0; there < bytes.size();) {
    const auto room = bytes.subspan(there, std::min(kMostAtOnce, bytes.size() - there));
    const ssize_t count = ::pread(file.value(), room.data(), room.size(), static_cast<off_t>(there));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw std::system_error(errno, std::generic_category(), "it can't be read");
    expect(count > 0, "it was cut short while it was read");
    const std::size_t end = there + static_cast<std::size_t>(count), from = std::max(there, kUnhashed);
    if (end > from) sha256.update(bytes.subspan(from, end - from));
    there = end;
  }
  return hex(sha256);
}

}  // namespace

std::string wide_key(const TriangleMesh& mesh) {
  constexpr WideBuildOptions options;
  const std::array<std::uint64_t, 5> how{kWideVersion, options.leaf_size, options.spatial_splits, mesh.positions.size(),
                                         mesh.triangles.size()};
  proto::Sha256 sha256;
  sha256.update(bytes_of(how));
  sha256.update(std::as_bytes(std::span(mesh.positions)));
  sha256.update(std::as_bytes(std::span(mesh.triangles)));
  const HexHash digits = hex(sha256);
  return {digits.begin(), digits.end()};
}

std::uint64_t wide_file_bytes(const WideTree& tree) {
  return sizeof(Header) + tree.nodes.size_bytes() + tree.leaves.size_bytes();
}

void write_wide_file(const std::filesystem::path& path, const std::string& key, const WideTree& tree) {
  Header header{};
  header.magic = kMagic;
  std::ranges::copy(key, header.key.begin());
  header.byte_order = kByteOrder;
  header.depth = tree.stats.depth;
  header.nodes = tree.nodes.size();
  header.words = tree.leaves.size();
  header.leaves = tree.stats.leaves;
  header.root = tree.root;
  header.checksum = checksum_of(header, std::as_bytes(tree.nodes), std::as_bytes(tree.leaves));
  ReceivedFile file(path.parent_path());
  file.write(bytes_of(header));
  file.write(std::as_bytes(tree.nodes));
  file.write(std::as_bytes(tree.leaves));
  file.keep_as(path);
}

std::optional<WideTree> read_wide_file(const std::filesystem::path& path, const std::string& key) {
  // Without O_NONBLOCK a pipe of that name would wait for somebody to write to it.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file && errno == ENOENT) return std::nullopt;
  struct stat status;
  if (!file || ::fstat(file.value(), &status) != 0)
    throw std::system_error(errno, std::generic_category(), "it can't be opened");
  if (!S_ISREG(status.st_mode)) throw std::system_error(EINVAL, std::generic_category(), "it is no file");
  const auto size = static_cast<std::uint64_t>(status.st_size);
  expect(size >= sizeof(Header), "it is too short");
  Header header;
  read_and_hash(file, std::as_writable_bytes(std::span(&header, 1)));
  expect(header.magic == kMagic && header.byte_order == kByteOrder && std::ranges::equal(header.key, key),
         "it is another file, or from another machine");
  const std::uint64_t room = size - sizeof(Header);
  expect(header.nodes <= room / sizeof(WideNode) &&
             header.words == (room - header.nodes * sizeof(WideNode)) / sizeof(std::uint32_t) && room % 4 == 0,
         "it is too short or too long");
  const auto memory = std::make_shared<const FileMemory>(size);
  const std::span<const std::byte> bytes = memory->bytes();
  // Damage that this lets pass is none: what the tree says needn't be looked at again.
  const HexHash checksum = read_and_hash(file, memory->bytes());
  expect(std::memcmp(bytes.data(), &header, sizeof header) == 0 && checksum == header.checksum, "it is damaged");
  const auto nodes = bytes.subspan(sizeof(Header), header.nodes * sizeof(WideNode));
  const auto leaves = bytes.subspan(sizeof(Header) + nodes.size());
  ::futimens(file.value(), nullptr);  // It was used now. Where that can't be noted, it goes sooner.

  WideTree tree;
  tree.root = header.root;
  tree.nodes = {reinterpret_cast<const WideNode*>(nodes.data()), header.nodes};
  tree.leaves = {reinterpret_cast<const std::uint32_t*>(leaves.data()), header.words};
  tree.stats = {
      .bytes = nodes.size() + leaves.size(), .nodes = header.nodes, .leaves = header.leaves, .depth = header.depth};
  tree.storage = memory;
  return tree;
}

}  // namespace tessera::server
