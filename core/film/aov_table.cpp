#include "core/film/aov_table.h"

#include "core/math/rounding.h"

namespace tessera {
namespace {

constexpr Rgb kBlack{}, kWhite{1, 1, 1};
constexpr Vec3 kZero{};

using enum AovOrigin;
constexpr std::array<AovEntry, kAovCount> kTable{{
    // Metres along the camera's axis.
    {Aov::depth, "depth", kInfinity, {"Z"}, first_sample, AovLook::nearness},
    // The shading normal: unit, in the world.
    {Aov::normal, "normal", kZero, {"N.X", "N.Y", "N.Z"}, first_sample, AovLook::direction},
    {Aov::primitive_id, "primitive_id", kNoId, {"primitiveId"}, first_sample, AovLook::hue},
    {Aov::object_id, "object_id", kNoId, {"objectId"}, first_sample, AovLook::hue},
    // All tests made for a pixel, whatever the kind of ray, per sample. They depend on the structure.
    {Aov::cost_volumes, "cost_volumes", 0.0F, {"cost.volumes"}, mean, AovLook::heat},
    {Aov::cost_primitives, "cost_primitives", 0.0F, {"cost.primitives"}, mean, AovLook::heat},
    // What the surface that is seen returns of white light from everywhere.
    {Aov::albedo, "albedo", kBlack, {"albedo.R", "albedo.G", "albedo.B"}, mean, AovLook::color},
    // Metres, in the world.
    {Aov::position, "position", kZero, {"P.X", "P.Y", "P.Z"}, first_sample, AovLook::extent},
    // The share of samples that see something other than the background.
    {Aov::alpha, "alpha", 0.0F, {"A"}, mean, AovLook::linear},
    {Aov::sample_count, "sample_count", std::uint32_t{0}, {"sampleCount"}, derived, AovLook::heat},
    // Of the pixel's colour, as a mean over its samples were they independent.
    {Aov::variance, "variance", kBlack, {"variance.R", "variance.G", "variance.B"}, derived, AovLook::heat},
    // The material's own number, without texture or light: what tells objects apart in label images.
    {Aov::base_color,
     "base_color",
     kWhite,
     {"baseColor.R", "baseColor.G", "baseColor.B"},
     first_sample,
     AovLook::linear},
}};

constexpr bool is_in_order() {
  for (std::size_t i = 0; i < kTable.size(); ++i)
    if (kTable[i].aov != static_cast<Aov>(i)) return false;
  return true;
}
static_assert(is_in_order());

}  // namespace

std::span<const AovEntry> aov_table() { return kTable; }

const AovEntry& aov_entry(Aov aov) { return kTable.at(static_cast<std::size_t>(aov)); }

}  // namespace tessera
