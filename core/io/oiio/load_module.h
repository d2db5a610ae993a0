#pragma once

#include "core/io/module_missing.h"

namespace tessera {

/// A function of the module tessera_oiio, which the first call loads: see `write_with_oiio`. Throws std::bad_alloc, and
/// `ModuleMissing` with the loader's words when there is none; later calls try again. Safe from any thread.
void* find_in_oiio_module(const char* name);

template <typename Function>
Function oiio_function(const char* name) {
  return reinterpret_cast<Function>(find_in_oiio_module(name));
}

}  // namespace tessera
