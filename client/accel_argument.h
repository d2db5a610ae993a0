#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace tessera::client {

/// A structure and its options as the command line has them, "bvh,bound=slabs,normals=1:0:0/0:1:1,space=object", made
/// the `accel` of a job document. A value is a number, a word, or vectors: a slash between two, colons between
/// coordinates. Which kinds and options there are is the server's to say. Nothing when the text isn't of that form or
/// gives an option twice.
std::optional<nlohmann::json> parse_accel(std::string_view text);

/// The other way: a kind and its options, as the server tells them, in the form that `parse_accel` takes.
std::string accel_argument(const std::string& kind, const nlohmann::json& options);

}  // namespace tessera::client
