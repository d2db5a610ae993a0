#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "server/single_flight.h"

namespace tessera::server {

/// An image as it is sent.
using EncodedImage = std::shared_ptr<const std::vector<std::byte>>;

/// Encoded images. A key begins with the job's id and says all that the bytes depend on.
class ImageCache : public SingleFlight<EncodedImage> {
 public:
  using SingleFlight::SingleFlight;
};

}  // namespace tessera::server
