#include "proto/wire/sha256.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>
#include <vector>

#include <openssl/evp.h>

namespace tessera::proto {
namespace {

constexpr std::string_view kPrefix = "sha256:";
constexpr std::size_t kHexDigits = 64;
constexpr std::size_t kFileChunk = 1 << 18;

void check(int openssl_result) {
  if (openssl_result != 1) throw std::runtime_error("OpenSSL can't compute SHA-256");
}

}  // namespace

bool is_content_hash(std::string_view text) {
  if (!text.starts_with(kPrefix) || text.size() != kPrefix.size() + kHexDigits) return false;
  return std::ranges::all_of(text.substr(kPrefix.size()),
                             [](char c) { return ('0' <= c && c <= '9') || ('a' <= c && c <= 'f'); });
}

struct Sha256::State {
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  check(EVP_DigestInit_ex(state_->context.get(), EVP_sha256(), nullptr));
}
Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(std::span<const std::byte> bytes) {
  check(EVP_DigestUpdate(state_->context.get(), bytes.data(), bytes.size()));
}

void Sha256::update(std::string_view text) { update(std::as_bytes(std::span(text))); }

ContentHash Sha256::finish() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  check(EVP_DigestFinal_ex(state_->context.get(), digest.data(), &size));
  ContentHash hash(kPrefix);
  for (unsigned int i = 0; i < size; ++i) {
    hash += "0123456789abcdef"[digest[i] >> 4];
    hash += "0123456789abcdef"[digest[i] & 15];
  }
  return hash;
}

ContentHash content_hash(std::string_view text) {
  Sha256 hash;
  hash.update(text);
  return hash.finish();
}

std::optional<ContentHash> hash_file(const std::filesystem::path& path, const std::stop_token& stop) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  Sha256 hash;
  std::vector<char> chunk(kFileChunk);
  while (file) {
    if (stop.stop_requested()) return std::nullopt;
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    hash.update(std::string_view(chunk.data(), static_cast<std::size_t>(file.gcount())));
  }
  if (!file.eof()) return std::nullopt;
  return hash.finish();
}

}  // namespace tessera::proto
