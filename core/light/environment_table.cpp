#include "core/light/environment_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/math/portable.h"
#include "core/math/portable_float.h"
#include "core/scene/studio.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWhole = 0x1p32;

Rgb mix(Rgb a, Rgb b, float share_of_b) { return a * (1 - share_of_b) + b * share_of_b; }
double mix(double a, double b, double share_of_b) { return a * (1 - share_of_b) + b * share_of_b; }

/// Begins of shares of [0, 2^32) in proportion to weights, which add up to more than 0.
void share_out(std::span<const double> weights, std::span<std::uint32_t> begins) {
  double total = 0, sum = 0;
  for (const double weight : weights) total += weight;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    begins[i] = static_cast<std::uint32_t>(std::min(sum / total * kWhole, kWhole - 1));
    sum += weights[i];
  }
}

double share_end(std::span<const std::uint32_t> begins, std::size_t i) {
  return i + 1 < begins.size() ? begins[i + 1] : kWhole;
}
double share_of(std::span<const std::uint32_t> begins, std::size_t i) {
  return (share_end(begins, i) - begins[i]) / kWhole;
}

struct Place {
  std::uint32_t index;
  double within;  ///< In [0, 1).
};
/// Whose share holds `u`, in [0, 1), and where in it.
Place place_in(std::span<const std::uint32_t> begins, double u) {
  const double at = u * kWhole;
  const auto next = std::ranges::upper_bound(begins, static_cast<std::uint32_t>(at));
  const auto index = static_cast<std::uint32_t>(next - begins.begin() - 1);
  return {index, (at - begins[index]) / (share_end(begins, index) - begins[index])};
}

/// In [0, 1], with a density that goes from `a` to `b` evenly.
double sample_linear(double u, double a, double b) {
  if (a + b == 0) return u;
  return u * (a + b) / (a + std::sqrt(mix(a * a, b * b, u)));
}

}  // namespace

/// The mean radiances of a cell's corners, by column and row.
struct EnvironmentTable::Corners {
  Rgb top[2], bottom[2];

  double at(double x, double y) const {
    return mix(mix(mean(top[0]), mean(top[1]), x), mix(mean(bottom[0]), mean(bottom[1]), x), y);
  }
  double whole() const { return (mean(top[0]) + mean(top[1]) + mean(bottom[0]) + mean(bottom[1])) / 4; }
};

EnvironmentTable::Corners EnvironmentTable::corners(std::uint32_t column, std::uint32_t row) const {
  const std::uint32_t width = map_->width, next = column + 1 < width ? column + 1 : 0;
  const std::size_t top = std::size_t{width} * (row > 0 ? row - 1 : 0);
  const std::size_t bottom = std::size_t{width} * std::min(row, map_->height - 1);
  const auto& texels = map_->texels;
  return {{texels[top + column], texels[top + next]}, {texels[bottom + column], texels[bottom + next]}};
}

std::span<const std::uint32_t> EnvironmentTable::shares(std::uint32_t row) const {
  return std::span(columns_).subspan(std::size_t{row} * map_->width, map_->width);
}

EnvironmentTable::EnvironmentTable(std::shared_ptr<const EnvironmentMap> map) : map_(std::move(map)) {
  const std::uint32_t width = map_->width, height = map_->height;
  cosines_.resize(height + 2);
  for (std::uint32_t row = 1; row <= height; ++row) cosines_[row] = portable_cos(kPi * (row - 0.5) / height);
  cosines_.front() = 1;
  cosines_.back() = -1;

  columns_.resize(std::size_t{width} * (height + 1));
  std::vector<double> row_weights(height + 1), weights(width);
  double total = 0;
  for (std::uint32_t row = 0; row <= height; ++row) {
    double sum = 0;
    for (std::uint32_t column = 0; column < width; ++column) sum += weights[column] = corners(column, row).whole();
    if (sum > 0) share_out(weights, std::span(columns_).subspan(std::size_t{row} * width, width));
    total += row_weights[row] = sum * (cosines_[row] - cosines_[row + 1]);
  }
  mean_radiance_ = total / (2.0 * width);
  rows_.resize(height + 1);
  if (total > 0) share_out(row_weights, rows_);
}

Vec3 EnvironmentTable::sample(Vec2 u) const {
  const Place row = place_in(rows_, u.y);
  const Place column = place_in(shares(row.index), u.x);
  const Corners c = corners(column.index, row.index);
  const double y = sample_linear(row.within, c.at(0.5, 0), c.at(0.5, 1));
  const double x = sample_linear(column.within, c.at(0, y), c.at(1, y));
  const double cosine = mix(cosines_[row.index], cosines_[row.index + 1], y);
  const double sine = std::sqrt((1 - cosine) * (1 + cosine));
  const auto around = sin_cos_turns(static_cast<float>((column.index + 0.5 + x) / map_->width - 0.5));
  return {static_cast<float>(sine * around.sin), static_cast<float>(cosine), static_cast<float>(-sine * around.cos)};
}

EnvironmentTable::Value EnvironmentTable::look_up(Vec3 direction) const {
  const std::uint32_t width = map_->width, height = map_->height;
  const Vec3d d = to_double(direction);
  const double turns = portable_detail::angle(d.x, -d.z) / (2 * kPi) + 0.5;
  const double down = portable_detail::angle(std::sqrt(d.x * d.x + d.z * d.z), d.y) / kPi;
  const double across = turns * width + width - 0.5;  // from the centre of the first texel of the map to the left
  const auto column = static_cast<std::uint32_t>(across) % width;
  const double along = std::min(down * height + 0.5, height + 0.5);
  const auto row = std::min(static_cast<std::uint32_t>(along), height);
  const double x = across - std::floor(across), y = along - row;

  const Corners c = corners(column, row);
  const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
  const Rgb radiance = mix(mix(c.top[0], c.top[1], fx), mix(c.bottom[0], c.bottom[1], fx), fy);
  if (mean_radiance_ == 0) return {radiance, 0};

  const double top = cosines_[row], height_of_row = top - cosines_[row + 1];
  const double share = share_of(rows_, row) * share_of(shares(row), column);
  const double solid_angle = 2 * kPi / width * height_of_row;
  const double whole = c.whole();
  const double y_by_area = std::clamp((top - d.y) / height_of_row, 0.0, 1.0);
  const double pdf = whole > 0 ? share / solid_angle * (c.at(x, y_by_area) / whole) : 0;
  return {radiance, pdf};
}

std::size_t EnvironmentTable::bytes() const {
  if (map_ == studio_environment()) return 0;
  return cosines_.size() * sizeof(double) + (rows_.size() + columns_.size()) * sizeof(std::uint32_t);
}

std::shared_ptr<const EnvironmentTable> environment_table(const std::shared_ptr<const EnvironmentMap>& map) {
  if (map != studio_environment()) return std::make_shared<const EnvironmentTable>(map);
  static const auto studio = std::make_shared<const EnvironmentTable>(map);
  return studio;
}

}  // namespace tessera
