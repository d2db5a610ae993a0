#pragma once

#include <string>
#include <string_view>
#include <variant>

namespace tessera::proto {

/// What a `data:` URI holds (RFC 2397).
struct DataUri {
  std::string_view media_type;  ///< Without parameters; may be empty.
  std::string bytes;
};

/// Whether it begins like one.
bool is_data_uri(std::string_view uri);

/// The content, or why there is none: no comma, a parameter without a value, bad base64.
std::variant<DataUri, std::string> read_data_uri(std::string_view uri);

/// The name of the companion file that a relative URI stands for, escapes resolved. URIs with a scheme, absolute paths
/// and paths that climb out of the folder of the file that names them are refused.
struct CompanionName {
  std::string name;
  std::string refusal;  ///< Why it may not be used; empty when it may.
};
CompanionName read_relative_uri(std::string_view uri);

}  // namespace tessera::proto
