#include "server/webhooks/public_address.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include <arpa/inet.h>

namespace tessera::server {
namespace {

using AddressBytes = std::array<std::uint8_t, 16>;

/// Addresses that begin with the same bits as one, which has its family.
struct AddressRange {
  const char* first;
  unsigned bits;
};

constexpr AddressRange kIpv4OfNoInternet[] = {
    {"0.0.0.0", 8},        // This network.
    {"10.0.0.0", 8},       // Private (RFC 1918).
    {"100.64.0.0", 10},    // Behind a carrier's NAT (RFC 6598).
    {"127.0.0.0", 8},      // Loopback.
    {"169.254.0.0", 16},   // Link-local; clouds tell machines their secrets here.
    {"172.16.0.0", 12},    // Private.
    {"192.0.0.0", 24},     // For protocols (RFC 6890).
    {"192.0.2.0", 24},     // For documents (RFC 5737),
    {"198.51.100.0", 24},  // as is this,
    {"203.0.113.0", 24},   // and this.
    {"192.88.99.0", 24},   // Relays of 6to4 (RFC 7526).
    {"192.168.0.0", 16},   // Private.
    {"198.18.0.0", 15},    // For benchmarks (RFC 2544).
    {"224.0.0.0", 4},      // Multicast.
    {"240.0.0.0", 4},      // Reserved, and broadcast.
};

/// What isn't in here is loopback, link-local, a site's own (RFC 4193), multicast, or nothing yet.
constexpr AddressRange kIpv6OfInternet = {"2000::", 3};
constexpr AddressRange kIpv6OfNoInternet[] = {
    {"2001::", 23},      // For protocols (RFC 2928): Teredo, benchmarks, names that look like addresses.
    {"2001:db8::", 32},  // For documents (RFC 3849).
    {"2002::", 16},      // 6to4, with any IPv4 address in it.
    {"3fff::", 20},      // For documents (RFC 9637).
};

/// Whose last 32 bits are an IPv4 address that is meant: as sockets write it (RFC 4291), and behind NAT64 (RFC 6052).
constexpr AddressRange kIpv4InIpv6[] = {{"::ffff:0:0", 96}, {"64:ff9b::", 96}};
constexpr std::size_t kIpv4At = 12;

struct ReadAddress {
  bool is_ipv4 = false;
  AddressBytes bytes{};  ///< The first four, of IPv4.
};

std::optional<ReadAddress> read_address(const char* text) {
  ReadAddress read;
  read.is_ipv4 = ::inet_pton(AF_INET, text, read.bytes.data()) == 1;
  if (read.is_ipv4 || ::inet_pton(AF_INET6, text, read.bytes.data()) == 1) return read;
  return std::nullopt;
}

bool is_in(const ReadAddress& address, const AddressRange& range) {
  const AddressBytes first = read_address(range.first)->bytes;
  const std::size_t whole = range.bits / 8;
  const auto rest = static_cast<std::uint8_t>(0xFF00U >> (range.bits % 8));
  return std::equal(first.begin(), first.begin() + whole, address.bytes.begin()) &&
         (address.bytes[whole] & rest) == (first[whole] & rest);
}

bool is_public(const ReadAddress& address) {
  const auto has_it = [&](const AddressRange& range) { return is_in(address, range); };
  if (address.is_ipv4) return std::ranges::none_of(kIpv4OfNoInternet, has_it);
  if (std::ranges::any_of(kIpv4InIpv6, has_it)) {
    ReadAddress within{true, {}};
    std::copy(address.bytes.begin() + kIpv4At, address.bytes.end(), within.bytes.begin());
    return is_public(within);
  }
  return has_it(kIpv6OfInternet) && std::ranges::none_of(kIpv6OfNoInternet, has_it);
}

}  // namespace

bool is_address(const std::string& text) { return read_address(text.c_str()).has_value(); }

bool is_public_address(const std::string& text) {
  const auto address = read_address(text.c_str());
  return address && is_public(*address);
}

}  // namespace tessera::server
