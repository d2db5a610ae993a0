#pragma once

#include <memory>
#include <stop_token>
#include <string_view>

#include "core/scene/light.h"
#include "proto/import/input_file.h"
#include "proto/wire/result.h"

namespace tessera::proto {

/// Reads an environment's map: a Radiance or OpenEXR image in memory of at most `max_bytes` of texels. What can't be
/// read, or has texels that aren't finite or are negative, is `invalid_document` whose detail says why; a missing
/// library is an `internal_error`. Throws `Abandoned`, and nothing else, soon after `stop` is requested.
Result<std::shared_ptr<const EnvironmentMap>> import_environment(const InputFile& file, std::string_view display_name,
                                                                 std::uint64_t max_bytes, std::stop_token stop = {});

}  // namespace tessera::proto
