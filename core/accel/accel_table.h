#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/accel/accel.h"

namespace tessera {

/// What an option's value is: a whole number, a name of `bound_names()` or `space_names()`, or the slabs' normals.
enum class AccelOptionType { number, bound, space, normals };

/// One row for every option there is.
struct AccelOptionEntry {
  std::string_view name;
  std::string_view summary;
  AccelOptionType type;
  std::uint32_t AccelOptions::*number = nullptr;  ///< Of numbers alone, like the range; null for the other types.
  std::uint32_t least = 0, most = 0;
  std::optional<BoundKind> only_with = std::nullopt;  ///< The bound without which it means nothing.
};
std::span<const AccelOptionEntry> accel_option_table();

/// One row for every structure there is: the table behind the wire's names, the capabilities and `make_accel`.
struct AccelEntry {
  AccelKind kind;
  std::string_view name;
  std::string_view summary;
  bool builds;                                ///< Whether making it takes more than collecting boxes.
  std::span<const std::string_view> options;  ///< Names of those it reads.
  std::unique_ptr<const Accel> (*make)(std::shared_ptr<const Scene>, const AccelOptions&);
};
std::span<const AccelEntry> accel_table();

/// The kind's row; null for `automatic`, which is no structure.
const AccelEntry* accel_entry(AccelKind kind);

/// The row's name, "auto" for `automatic`.
std::string_view accel_name(AccelKind kind);

/// A bound's and a space's name, in the order of their enumerations.
std::span<const std::string_view> bound_names();
std::span<const std::string_view> space_names();

/// Kind and options in use, e.g. "bvh bound=slabs normals=(1,0,0)... space=world leaf_size=8": equal for options that
/// make equal structures.
std::string describe(const AccelOptions& options);

}  // namespace tessera
