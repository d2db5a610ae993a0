#pragma once

#include <optional>
#include <string>
#include <string_view>

/// What the grammar of HTTP calls things (RFC 9110, 5; RFC 3986 for hosts).
namespace tessera::server {

/// One or more of the characters that names of methods and headers are made of (RFC 9110, 5.6.2).
bool is_token(std::string_view text);

/// No controls but the tab: what the value of a header may hold (RFC 9110, 5.5).
bool is_field_value(std::string_view text);

/// "name: value" without the line's end, as a header or a trailer has it (RFC 9112, 5).
bool is_field_line(std::string_view line);

/// Only what may stand in a path or a query, percent signs included (RFC 3986, 3.3 and 3.4).
bool is_path_and_query(std::string_view text);

/// "host" or "host:port": a name, an IPv4 address or an IPv6 one in brackets (RFC 9110, 7.2). One: no list of them.
/// Empty where nobody has a name for the server.
bool is_host(std::string_view text);

/// The host of "host" or "host:port" as it is compared with others: in lower case, without the port and the dot that a
/// full name may end in; an address in its shortest form, without brackets, an IPv4 one inside IPv6 as IPv4.
std::string canonical_host(std::string_view host);

/// Without spaces and tabs at both ends.
std::string_view trimmed(std::string_view text);

/// Whether two texts are the same but for the case of ASCII letters.
bool equal_but_for_case(std::string_view a, std::string_view b);

/// Undoes percent encoding (RFC 3986, 2.1); nothing where a percent sign stands before no two digits.
std::optional<std::string> percent_decode(std::string_view text);

}  // namespace tessera::server
