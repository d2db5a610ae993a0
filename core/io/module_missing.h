#pragma once

#include <stdexcept>

namespace tessera {

/// The module tessera_oiio, through which OpenImageIO is called, can't be loaded: a fault of the installation, not of a
/// file.
class ModuleMissing : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tessera
