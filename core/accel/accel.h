#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/accel/object_marks.h"
#include "core/math/ray.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"

namespace tessera {

/// What a ray met first. Hits are ordered by (t, object, primitive): at equal t the smaller identity wins.
struct Hit {
  float t = kInfinity;
  std::uint32_t object = 0;
  std::uint32_t primitive = 0;  ///< Within the object's shape.

  auto operator<=>(const Hit&) const = default;
};

/// What a structure is made of.
struct AccelStats {
  std::uint64_t bytes = 0;
  std::uint64_t nodes = 0;
  std::uint64_t leaves = 0;
  std::uint32_t depth = 0;
};

/// The seam: every structure answers the same two questions with the same bits (laws L1 and L2 of the design).
/// Immutable once made; all calls are safe from any number of threads. A ray that isn't `is_traceable` misses. Objects
/// that are tested, beyond their bounds, are marked in `tested` if that is given.
class Accel {
 public:
  virtual ~Accel() = default;

  /// The smallest hit in the ray's open interval.
  virtual std::optional<Hit> closest(const Ray& ray, ObjectMarks* tested = nullptr) const = 0;

  /// Whether anything at all lies in the ray's open interval.
  virtual bool occluded(const Ray& ray, ObjectMarks* tested = nullptr) const = 0;

  /// Like `closest`, over these objects only (ascending indices): a first-level ray that knows what projects
  /// into its tile.
  virtual std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                           ObjectMarks* tested = nullptr) const = 0;

  virtual AccelStats stats() const = 0;
};

/// One row for every structure there is: the table behind the wire's names and the capabilities.
struct AccelEntry {
  AccelKind kind;
  std::string_view name;
  std::string_view summary;
  bool builds;  ///< Whether making it takes more than collecting boxes.
  std::unique_ptr<const Accel> (*make)(std::shared_ptr<const Scene>);
};
std::span<const AccelEntry> accel_table();

/// Builds the structure. Precondition: `kind` isn't `automatic` (the plan settles that).
std::unique_ptr<const Accel> make_accel(std::shared_ptr<const Scene> scene, AccelKind kind);

/// The row's name, "auto" for `automatic`.
std::string_view accel_name(AccelKind kind);

}  // namespace tessera
