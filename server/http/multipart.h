#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/result.h"

namespace tessera::server {

/// A part of a form, as it stands in the body.
struct FormPart {
  std::string name;
  std::optional<std::string> file_name;  ///< As it was sent: any text but control characters.
  std::string content_type;              ///< Empty where the part has none.
  std::string_view content;
};

/// The parts of a body of the type multipart/form-data (RFC 7578), in their order; `content_type` is that header's
/// value, with the boundary. What stands before the first boundary and after the last is skipped (RFC 2046, 5.1.1).
/// `malformed_request` for all that isn't such a form: no boundary, a part without a name, headers that aren't, another
/// Content-Transfer-Encoding than binary, more than `kMostParts`; and where the last boundary is missing. Takes time in
/// proportion to the body's size.
proto::Result<std::vector<FormPart>> parse_form(std::string_view content_type, std::string_view body);

inline constexpr std::size_t kMostParts = 4096;

}  // namespace tessera::server
