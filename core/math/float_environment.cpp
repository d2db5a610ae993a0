#include "core/math/float_environment.h"

namespace tessera {

StrictFloats::StrictFloats() {
  std::fegetenv(&callers_);
  std::fesetenv(FE_DFL_ENV);
}

StrictFloats::~StrictFloats() { std::fesetenv(&callers_); }

}  // namespace tessera
