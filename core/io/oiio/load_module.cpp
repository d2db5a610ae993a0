#include "core/io/oiio/load_module.h"

#include <new>
#include <string>

#include <dlfcn.h>

namespace tessera {
namespace {

/// Looked for in lib/tessera beside the program's folder, as its run path says.
constexpr const char* kModule = "tessera_oiio.so";

[[noreturn]] void fail() {
  const std::string why = dlerror();
  // The loader has no other way to say so.
  for (const char* words :
       {"Cannot allocate memory", "cannot allocate", "failed to map", "cannot create shared object"})
    if (why.find(words) != std::string::npos) throw std::bad_alloc();
  throw ModuleMissing("OpenImageIO isn't there: " + why);
}

}  // namespace

void* find_in_oiio_module(const char* name) {
  void* module = dlopen(kModule, RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) fail();
  void* function = dlsym(module, name);
  if (function == nullptr) fail();
  return function;
}

}  // namespace tessera
