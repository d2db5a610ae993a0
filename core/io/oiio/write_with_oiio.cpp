#include "core/io/oiio/write_with_oiio.h"

#include "core/io/oiio/load_module.h"
#include "core/io/oiio/oiio_module.h"

namespace tessera {

std::optional<std::vector<std::byte>> write_with_oiio(ImageFormat format, const Raster& raster,
                                                      const std::stop_token& stop) {
  static const auto kWrite = oiio_function<decltype(&tessera_oiio_write)>("tessera_oiio_write");
  std::optional<std::vector<std::byte>> file;
  kWrite(format, raster, stop, file);
  return file;
}

}  // namespace tessera
