#include "core/io/oiio/write_with_oiio.h"

#include <new>
#include <stdexcept>
#include <string>

#include <dlfcn.h>

#include "core/io/oiio/oiio_module.h"

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
  throw std::runtime_error("OpenImageIO isn't there: " + why);
}

decltype(&tessera_oiio_write) load() {
  void* module = dlopen(kModule, RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) fail();
  void* write = dlsym(module, "tessera_oiio_write");
  if (write == nullptr) fail();
  return reinterpret_cast<decltype(&tessera_oiio_write)>(write);
}

}  // namespace

std::optional<std::vector<std::byte>> write_with_oiio(ImageFormat format, const Raster& raster,
                                                      const std::stop_token& stop) {
  static const auto kWrite = load();
  std::optional<std::vector<std::byte>> file;
  kWrite(format, raster, stop, file);
  return file;
}

}  // namespace tessera
