#include "core/math/srgb.h"

#include "core/math/portable.h"

namespace tessera {

float light_of_encoded(double encoded) {
  if (!(encoded > 0)) return 0;
  if (encoded >= 1) return 1;
  if (encoded <= 0.04045) return static_cast<float>(encoded / 12.92);
  return static_cast<float>(portable_exp2(portable_log2((encoded + 0.055) / 1.055) * 2.4));
}

}  // namespace tessera
