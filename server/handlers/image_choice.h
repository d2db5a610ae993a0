#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/image_io.h"
#include "core/scene/settings.h"
#include "proto/wire/choice.h"
#include "proto/wire/result.h"
#include "server/http/request.h"

namespace tessera::server {

/// A format on the wire. The table is in the order in which the server prefers them.
struct FormatEntry {
  ImageFormat format;
  std::string_view name;
  std::string_view media_type;
};
std::span<const FormatEntry> format_table();

/// A value of `?aov=`.
struct PlaneEntry {
  Plane plane;            ///< If it is an AOV's, a job has to record that for it.
  std::string_view name;  ///< Empty for the colour, which is what comes without the parameter.
};
std::span<const PlaneEntry> plane_table();

/// The values of `?tone_map=`.
std::span<const proto::Choice<ToneMap>> tone_map_names();

struct ImageChoice {
  Plane plane;
  FormatEntry format;
  Encoding encoding;
  bool partial;
};

/// What a request needn't say.
struct ImageDefaults {
  ToneMap tone_map = ToneMap::none;
  std::optional<Rgb> background;  ///< Of an image that is transparent, in formats for display.
};

/// A colour written as six hexadecimal digits, with or without a #, or as "white" or "black", in linear light; nothing
/// when it is none.
std::optional<Rgb> read_hex_color(std::string_view text);

/// The formats that can hold a plane of an image that is rendered with these settings, as a list for people: "png
/// (image/png), ...". Empty when there are none.
std::string able_formats(Plane plane, const Settings& settings);

/// The image that a request asks for by `?aov=`, `?partial=`, `?format=` or else its Accept header, for JPEG
/// `?quality=` and `?subsampling=`, for the colour of PNG and JPEG `?exposure=` and `?tone_map=`, and for EXR
/// `?precision=`, and for what is transparent in PNG and JPEG `?background=`, of a job that is rendered with these
/// settings. Refusals: `malformed_request` for a value that means nothing, also with this format; `not_found` for an
/// AOV that wasn't recorded; `not_acceptable` when no format that is accepted can hold the plane, or an image of this
/// size.
proto::Result<ImageChoice> choose_image(const Request& request, const Settings& settings,
                                        const ImageDefaults& defaults = {});

}  // namespace tessera::server
