#pragma once

#include <chrono>
#include <filesystem>
#include <string>

struct ssl_st;   // OpenSSL's SSL,
struct x509_st;  // and X509.

namespace tessera::proto {

/// What a server's certificate and its key, which lie in PEM files, say of themselves.
struct Certificate {
  std::chrono::sys_seconds valid_from, expires;  ///< Those of the whole chain: the latest and the earliest.
  bool others_can_read_key = false;              ///< Every user of this machine.
};

/// Reads a file with a server's certificate and, after it, those that vouch for it, and a file with the key that
/// belongs to the first. Throws std::runtime_error, which names the file, when one can't be read or isn't one, when the
/// key is encrypted, or when the two don't belong together.
Certificate read_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key);

/// When a certificate ends.
std::chrono::sys_seconds expiry_of(const x509_st& certificate);

/// Has the server asked for its certificate by the name, or the address, that it is called by, and has that compared
/// (RFC 6125). False where no certificate could have it.
bool expect_name(ssl_st& connection, const std::string& host);

}  // namespace tessera::proto
