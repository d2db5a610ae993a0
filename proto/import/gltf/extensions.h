#pragma once

#include "proto/import/gltf/file.h"

namespace tessera::proto {

/// Looks at the document's asset, and at the extensions that it declares: an error for a version that isn't 2.x, and
/// for every required extension that isn't known here; a note about those that are used and aren't known.
void check_asset(GltfFile& file);

}  // namespace tessera::proto
