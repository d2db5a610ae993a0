#include "proto/wire/certificate.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;
using std::chrono::sys_seconds;

using File = std::unique_ptr<std::FILE, decltype(&std::fclose)>;
using X509Owner = std::unique_ptr<X509, decltype(&X509_free)>;
using PkeyOwner = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

File open(const fs::path& path, const char* what) {
  File file(std::fopen(path.c_str(), "re"), &std::fclose);
  if (!file)
    throw std::runtime_error("can't read " + std::string(what) + ' ' + path.string() + ": " +
                             std::generic_category().message(errno));
  return file;
}

sys_seconds to_time(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) throw std::runtime_error("a certificate's time isn't one");
  return sys_seconds(std::chrono::seconds(::timegm(&parts)));
}

/// Who asks for a passphrase is told that there is none; OpenSSL would ask the terminal.
int no_passphrase(char*, int, int, void* was_asked) {
  *static_cast<bool*>(was_asked) = true;
  return -1;
}

X509Owner next_certificate(std::FILE& file) {
  bool was_asked = false;
  return {PEM_read_X509(&file, nullptr, no_passphrase, &was_asked), &X509_free};
}

}  // namespace

sys_seconds expiry_of(const X509& certificate) { return to_time(X509_get0_notAfter(&certificate)); }

bool expect_name(SSL& connection, const std::string& host) {
  X509_VERIFY_PARAM* const wanted = SSL_get0_param(&connection);
  if (X509_VERIFY_PARAM_set1_ip_asc(wanted, host.c_str()) == 1) return true;  // RFC 6066 has no addresses there.
  return SSL_set_tlsext_host_name(&connection, host.c_str()) == 1 &&
         X509_VERIFY_PARAM_set1_host(wanted, host.c_str(), host.size()) == 1;
}

Certificate read_certificate(const fs::path& certificate, const fs::path& key) {
  const File chain = open(certificate, "the certificate");
  const X509Owner own = next_certificate(*chain);
  if (!own) throw std::runtime_error(certificate.string() + " holds no certificate (PEM, BEGIN CERTIFICATE)");
  Certificate read{to_time(X509_get0_notBefore(own.get())), expiry_of(*own)};
  while (const X509Owner issuer = next_certificate(*chain)) {
    read.valid_from = std::max(read.valid_from, to_time(X509_get0_notBefore(issuer.get())));
    read.expires = std::min(read.expires, expiry_of(*issuer));
  }

  const File secret = open(key, "the key");
  bool is_encrypted = false;
  const PkeyOwner private_key(PEM_read_PrivateKey(secret.get(), nullptr, no_passphrase, &is_encrypted), &EVP_PKEY_free);
  if (is_encrypted)
    throw std::runtime_error("the key " + key.string() + " is encrypted; write it without a passphrase (openssl pkey)");
  if (!private_key) throw std::runtime_error(key.string() + " holds no private key (PEM, BEGIN PRIVATE KEY)");
  if (X509_check_private_key(own.get(), private_key.get()) != 1)
    throw std::runtime_error("the key " + key.string() + " isn't that of the certificate " + certificate.string());
  struct stat about {};
  read.others_can_read_key = ::fstat(fileno(secret.get()), &about) == 0 && (about.st_mode & S_IROTH) != 0;
  ERR_clear_error();  // The end of the chain is one.
  return read;
}

}  // namespace tessera::proto
