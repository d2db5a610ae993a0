#include "server/webhooks/webhook_target.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "server/http/http_syntax.h"
#include "server/webhooks/public_address.h"

namespace tessera::server {
namespace {

constexpr std::string_view kTls = "https://", kPlain = "http://", kBelow = "*.";
constexpr std::uint16_t kTlsPort = 443, kPlainPort = 80;

proto::Problem no_webhook(std::string why) {
  return {proto::ProblemCode::invalid_document, "The job's webhook can't be used.", {{"/webhook", std::move(why)}}};
}

/// What names of hosts consist of, whatever else a URI may have there.
bool is_plain_host(std::string_view host) {
  return !host.empty() && !host.starts_with('.') && std::ranges::all_of(host, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '_' || c == ':';
  });
}

struct HostAndPort {
  std::string host;
  std::optional<std::uint16_t> port;
};

/// "host" or "host:port"; nothing where it is neither.
std::optional<HostAndPort> read_host_and_port(std::string_view text) {
  if (!is_host(text)) return std::nullopt;
  HostAndPort read{canonical_host(text), std::nullopt};
  if (!is_plain_host(read.host)) return std::nullopt;
  const std::size_t colon = text.find(':', text.starts_with('[') ? text.find(']') : 0);
  if (colon == std::string_view::npos) return read;
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data() + colon + 1, text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0) return std::nullopt;
  read.port = port;
  return read;
}

bool is_allowed_by(std::string_view entry, const WebhookTarget& target) {
  const bool takes_names_below = entry.starts_with(kBelow);
  if (takes_names_below) entry.remove_prefix(kBelow.size());
  const auto read = read_host_and_port(entry);
  if (!read || target.port != read->port.value_or(target.is_tls ? kTlsPort : kPlainPort)) return false;
  return takes_names_below ? target.host.ends_with('.' + read->host) : target.host == read->host;
}

}  // namespace

bool is_webhook_host(std::string_view text) {
  if (text.starts_with(kBelow)) text.remove_prefix(kBelow.size());
  return read_host_and_port(text).has_value();
}

std::string WebhookTarget::authority() const {
  std::string text = host.find(':') == std::string::npos ? host : '[' + host + ']';
  if (port != (is_tls ? kTlsPort : kPlainPort)) text += ':' + std::to_string(port);
  return text;
}

proto::Result<WebhookTarget> read_webhook(const WebhookRules& rules, std::string_view url) {
  if (rules.hosts.empty()) return no_webhook("This server sends none: who runs it allows hosts by --webhook-host.");
  WebhookTarget target;
  target.is_tls = url.starts_with(kTls);
  if (!target.is_tls && !url.starts_with(kPlain)) return no_webhook("Write it as https://hooks.example.org/path.");
  if (!target.is_tls && !rules.allow_private) return no_webhook("Only https:// is allowed here.");
  const std::string_view authority = host_of_webhook(url);
  const std::string_view rest = url.substr((target.is_tls ? kTls : kPlain).size() + authority.size());
  if (authority.find('@') != std::string_view::npos)
    return no_webhook("A URL with a user or a password isn't taken; the signature tells who sends it.");
  const auto read = read_host_and_port(authority);
  if (!read) return no_webhook("This has no host, or no port, that there can be.");
  target.host = read->host;
  target.port = read->port.value_or(target.is_tls ? kTlsPort : kPlainPort);
  if (!is_path_and_query(rest)) return no_webhook("Its path or query holds what no URL has there, or a fragment.");
  target.path = rest.starts_with('/') ? std::string(rest) : '/' + std::string(rest);
  if (std::ranges::none_of(rules.hosts, [&](const std::string& entry) { return is_allowed_by(entry, target); }))
    return no_webhook("This server sends nothing to " + target.authority() +
                      ": who runs it allows hosts by --webhook-host.");
  if (!rules.allow_private && is_address(target.host) && !is_public_address(target.host))
    return no_webhook(
        "The internet doesn't reach this address; who runs the server allows such by "
        "--webhook-allow-private.");
  return target;
}

std::string_view host_of_webhook(std::string_view url) {
  url.remove_prefix(std::min(url.find("://") + 3, url.size()));
  return url.substr(0, url.find_first_of("/?#"));
}

}  // namespace tessera::server
