#include "server/webhooks/webhook_secret.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/wire/uri.h"
#include "server/http/http_syntax.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {
namespace {

constexpr std::string_view kSecretPrefix = "whsec_";
constexpr std::size_t kLeastSecret = 24, kMostSecret = 64, kMostSecretFile = 4096;

void cleanse(std::string& secret) { OPENSSL_cleanse(secret.data(), secret.size()); }

/// A secret's bytes; none where the line isn't one.
std::string read_secret(std::string_view line) {
  if (!line.starts_with(kSecretPrefix)) return "";
  std::string uri = "data:;base64,";
  uri += line.substr(kSecretPrefix.size());
  auto read = proto::read_data_uri(uri);
  cleanse(uri);
  auto* const data = std::get_if<proto::DataUri>(&read);
  return data ? std::move(data->bytes) : "";
}

std::string read_secret_file(const std::filesystem::path& path) {
  const auto refuse_it = [&](const std::string& why) {
    throw std::runtime_error("the webhooks' secret " + path.string() + ' ' + why);
  };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat about {};
  std::string text(kMostSecretFile + 1, '\0');
  ssize_t size = -1;
  if (file && ::fstat(file.value(), &about) == 0) size = ::read(file.value(), text.data(), text.size());
  if (size < 0) refuse_it("can't be read: " + std::generic_category().message(errno));
  if ((about.st_mode & S_IROTH) != 0) refuse_it("can be read by every user of this machine; chmod o= it");
  if (static_cast<std::size_t>(size) > kMostSecretFile) refuse_it("is too large to be one");
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::string base64_of(const unsigned char* bytes, unsigned size) {
  std::string text((size + 2) / 3 * 4 + 1, '\0');  // And the zero that OpenSSL ends it with.
  text.resize(static_cast<std::size_t>(
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes, static_cast<int>(size))));
  return text;
}

}  // namespace

WebhookSecrets::WebhookSecrets(const std::filesystem::path& file) {
  std::string text = read_secret_file(file);
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty()) continue;
    keys_.push_back(read_secret(line));
    if (keys_.back().size() >= kLeastSecret && keys_.back().size() <= kMostSecret) continue;
    cleanse(text);
    throw std::runtime_error("the webhooks' secret " + file.string() +
                             " isn't one: write whsec_ and 24 to 64 random bytes in base64 (echo whsec_$(openssl rand "
                             "-base64 32)), once a line");
  }
  cleanse(text);
  if (keys_.empty()) throw std::runtime_error("the webhooks' secret " + file.string() + " is empty");
}

WebhookSecrets::~WebhookSecrets() { std::ranges::for_each(keys_, cleanse); }

std::string WebhookSecrets::sign(std::string_view id, std::chrono::sys_seconds time, std::string_view body) const {
  std::string content(id);
  ((content += '.') += std::to_string(time.time_since_epoch().count())) += '.';
  content += body;
  std::string signatures;
  for (const std::string& key : keys_) {
    unsigned char mac[EVP_MAX_MD_SIZE];
    unsigned size = 0;
    if (!HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
              reinterpret_cast<const unsigned char*>(content.data()), content.size(), mac, &size))
      throw std::runtime_error("OpenSSL can't sign");
    signatures += (signatures.empty() ? "v1," : " v1,") + base64_of(mac, size);
  }
  return signatures;
}

}  // namespace tessera::server
