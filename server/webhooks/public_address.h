#pragma once

#include <string>

namespace tessera::server {

/// Whether `text` is an IPv4 or an IPv6 address, without brackets.
bool is_address(const std::string& text);

/// Whether an address is one that anybody on the internet may have: neither loopback's nor a network's own, nor one
/// that stands for many or for none. False for what is no address. An IPv4 address within an IPv6 one is looked at as
/// it is. Source: IANA's registries of special-purpose addresses (RFC 6890).
bool is_public_address(const std::string& text);

}  // namespace tessera::server
