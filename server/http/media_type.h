#pragma once

#include <span>
#include <string_view>

namespace tessera::server {

/// Whether a Content-Type names this media type, whatever its parameters and case.
bool is_media_type(std::string_view content_type, std::string_view media_type);

/// The weight, 0..1, that an Accept header gives to a media type ("image/png"): the q of the most specific range
/// that covers it, 0 when none does (RFC 9110, 12.5.1). A range that can't be read counts for nothing.
double acceptance(std::string_view accept, std::string_view media_type);

}  // namespace tessera::server
