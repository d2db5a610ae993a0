#pragma once

#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "core/io/image_io.h"
#include "core/scene/settings.h"
#include "proto/wire/result.h"
#include "server/request.h"

namespace tessera::server {

/// A format on the wire. The table is in the order in which the server prefers them.
struct FormatEntry {
  ImageFormat format;
  std::string_view name;
  std::string_view media_type;
};
std::span<const FormatEntry> format_table();

/// A value of `?aov=`, and the formats that can hold it.
struct PlaneEntry {
  Plane plane;
  std::optional<Aov> aov;  ///< That a job has to record for it; none for the colour and for `all`.
  std::string_view name;   ///< Empty for the colour, which is what comes without the parameter.
  std::set<ImageFormat> formats;
};
std::span<const PlaneEntry> plane_table();

struct ImageChoice {
  Plane plane;
  FormatEntry format;
  bool partial;
};

/// The image that a request asks for by `?aov=`, `?partial=`, `?format=` or else its Accept header, of a job that
/// recorded these AOVs. Refusals: `malformed_request` for a value that means nothing, `not_found` for an AOV that
/// wasn't recorded, `not_acceptable` when no format that is accepted can hold the plane.
proto::Result<ImageChoice> choose_image(const Request& request, const std::set<Aov>& recorded);

}  // namespace tessera::server
