#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "server/store/single_flight.h"

namespace tessera::server {

/// An image as it is sent.
struct SentImage {
  std::vector<std::byte> bytes;
  std::string etag;
};
using EncodedImage = std::shared_ptr<const SentImage>;

/// Encoded images. A key begins with the job's id and says all that the bytes depend on; of an image that isn't
/// complete, they may be of a later moment than the key, which their ETag tells.
class ImageCache : public SingleFlight<EncodedImage> {
 public:
  using SingleFlight::SingleFlight;
};

}  // namespace tessera::server
