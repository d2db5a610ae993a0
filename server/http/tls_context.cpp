#include "server/http/tls_context.h"

#include <chrono>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <spdlog/spdlog.h>

#include "proto/wire/certificate.h"
#include "server/rfc3339.h"

namespace tessera::server {
namespace {

/// Who renews certificates by themselves has done so by then.
constexpr std::chrono::days kSoon{14};

/// As ALPN has it: a length, and so many characters.
constexpr unsigned char kHttp11[] = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};

int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered,
                    unsigned int offered_size, void*) {
  unsigned char* found = nullptr;
  if (SSL_select_next_proto(&found, size, kHttp11, sizeof kHttp11, offered, offered_size) != OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

[[noreturn]] void refuse_tls(const std::string& what) {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  throw std::runtime_error(what + ": " + (reason ? reason : "OpenSSL doesn't say why"));
}

}  // namespace

void TlsStateDeleter::operator()(ssl_st* state) const noexcept { SSL_free(state); }

TlsContext::TlsContext(std::filesystem::path certificate, std::filesystem::path key)
    : certificate_(std::move(certificate)), key_(std::move(key)), context_(read()) {}

void TlsContext::reload() {
  auto context = read();
  const std::lock_guard lock(mutex_);
  context_.swap(context);
}

TlsState TlsContext::accept(int socket) const {
  std::shared_ptr<SSL_CTX> context;
  {
    const std::lock_guard lock(mutex_);
    context = context_;
  }
  TlsState state(SSL_new(context.get()));
  if (!state || SSL_set_fd(state.get(), socket) != 1) {
    ERR_clear_error();
    throw std::bad_alloc();
  }
  SSL_set_accept_state(state.get());
  return state;
}

std::shared_ptr<SSL_CTX> TlsContext::read() const {
  const proto::Certificate certificate = proto::read_certificate(certificate_, key_);

  ERR_clear_error();
  std::shared_ptr<SSL_CTX> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (!context) refuse_tls("there can be no TLS");
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  SSL_CTX_set_cipher_list(context.get(), "ECDHE+AESGCM:ECDHE+CHACHA20");  // Of TLS 1.2; all of 1.3 are such.
  // A peer that closes its side without a word has no more to send: what HTTP says of lengths tells what is missing.
  SSL_CTX_set_options(context.get(), SSL_OP_NO_RENEGOTIATION | SSL_OP_IGNORE_UNEXPECTED_EOF);
  // What was begun to be sent is tried again from wherever it lies then. A connection that waits keeps no buffers.
  SSL_CTX_set_mode(context.get(),
                   SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER | SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_clear_mode(context.get(), SSL_MODE_AUTO_RETRY);  // Or a peer that sends nothing but news of keys has no end.
  SSL_CTX_set_read_ahead(context.get(), 1);                // One call of the system a record, not two.
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);  // Tickets are kept by clients.
  SSL_CTX_set_alpn_select_cb(context.get(), choose_protocol, nullptr);
  if (SSL_CTX_use_certificate_chain_file(context.get(), certificate_.c_str()) != 1)
    refuse_tls("the certificate " + certificate_.string() + " can't be used");
  if (SSL_CTX_use_PrivateKey_file(context.get(), key_.c_str(), SSL_FILETYPE_PEM) != 1)
    refuse_tls("the key " + key_.string() + " can't be used");

  const std::string end = rfc3339(certificate.expires);
  const auto now = std::chrono::system_clock::now();
  if (now < certificate.valid_from)
    spdlog::warn("the certificate {} isn't valid before {}", certificate_.string(), rfc3339(certificate.valid_from));
  else if (now >= certificate.expires)
    spdlog::error("the certificate {} has expired: it was valid until {}", certificate_.string(), end);
  else if (now >= certificate.expires - kSoon)
    spdlog::warn("the certificate {} expires soon: it is valid until {}", certificate_.string(), end);
  else
    spdlog::info("the certificate {} is valid until {}", certificate_.string(), end);
  if (certificate.others_can_read_key)
    spdlog::warn("every user of this machine can read the key {}; chmod o= {}", key_.string(), key_.string());
  return context;
}

}  // namespace tessera::server
