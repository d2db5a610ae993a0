#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tessera::server {

/// A member of the object that a JSON text is, as it is written.
struct JsonMember {
  std::string name;
  std::string_view value;
};

/// The members of the outermost object, found in one walk over strings and brackets that takes no memory for what they
/// hold. Of a text that isn't JSON, or no object, some of them, or none: who parses it says what is wrong.
std::vector<JsonMember> json_members(std::string_view text);

/// The elements of the array that a JSON text is, likewise.
std::vector<std::string_view> json_elements(std::string_view text);

bool has_member(std::string_view text, std::string_view name);

}  // namespace tessera::server
