#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

struct ssl_st;      // OpenSSL's SSL,
struct ssl_ctx_st;  // and SSL_CTX.

namespace tessera::server {

struct TlsStateDeleter {
  void operator()(ssl_st* state) const noexcept;
};
/// One connection's side of TLS.
using TlsState = std::unique_ptr<ssl_st, TlsStateDeleter>;

/// What all connections that speak TLS share: a certificate and its key. TLS 1.2 (RFC 5246) with ephemeral keys and
/// authenticated encryption, and TLS 1.3 (RFC 8446); of protocols within (ALPN, RFC 7301) it knows HTTP/1.1. Safe to
/// use from any number of threads.
class TlsContext {
 public:
  /// PEM files: the server's certificate with those that vouch for it behind it, and its key. Throws std::runtime_error
  /// as `proto::read_certificate` does. What may soon be wrong with them is logged.
  TlsContext(std::filesystem::path certificate, std::filesystem::path key);

  /// Reads the files again, for connections that begin from now on. When that throws, all stays as it is.
  void reload();

  /// Of a connection that begins. Throws std::bad_alloc.
  TlsState accept(int socket) const;

 private:
  std::shared_ptr<ssl_ctx_st> read() const;

  const std::filesystem::path certificate_, key_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::shared_ptr<ssl_ctx_st> context_;
};

}  // namespace tessera::server
