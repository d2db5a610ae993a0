#include "core/film/sums.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

Rgb operator-(Rgb a, Rgb b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
Rgb operator/(Rgb a, float s) { return {a.r / s, a.g / s, a.b / s}; }

std::set<Aov> means(const Settings& settings) {
  std::set<Aov> aovs;
  for (const Aov aov : settings.aovs)
    if (aov_entry(aov).origin == AovOrigin::mean) aovs.insert(aov);
  return aovs;
}

bool is_on_white(const Settings& settings) {
  return measures_error(settings) && settings.transparent && settings.aovs.contains(Aov::alpha);
}

template <typename T>
T sum_of(T sum, T value, std::uint32_t times) {
  for (; times > 0; --times) {
    const T next = sum + value;
    if (next == sum) break;
    sum = next;
  }
  return sum;
}

template <typename T>
void divide(const std::vector<T>& totals, std::size_t pixel, float by, std::vector<T>& out) {
  if constexpr (requires(T v) { v / by; }) out[pixel] = totals[pixel] / by;
}

}  // namespace

Sums::Sums(PixelRect rect, const Settings& settings) : totals(rect, means(settings)) {
  const auto count = static_cast<std::size_t>(rect.area());
  if (measures_error(settings)) second.resize(count);
  if (is_on_white(settings)) clear = {std::vector<float>(count), std::vector<float>(count)};
  if (!settings.aovs.contains(Aov::variance)) return;
  mean.resize(count);
  squares.resize(count);
}

void Sums::add(std::size_t pixel, std::uint32_t sample, Rgb color, float covered) {
  Rgb& sum = !second.empty() && sample % 2 == 1 ? second[pixel] : totals.color[pixel];
  sum = sum + color;
  if (std::vector<float>& of_half = clear[sample % 2]; !of_half.empty()) of_half[pixel] += 1 - covered;
  if (mean.empty()) return;
  const Rgb before = color - mean[pixel];
  mean[pixel] = mean[pixel] + before / (static_cast<float>(sample) + 1);
  squares[pixel] = squares[pixel] + before * (color - mean[pixel]);
}

void Sums::add_equal(PixelRect where, SampleRange samples, Rgb color, float covered) {
  const auto add_to = [&]<typename T>(std::vector<T>& sums, T value, std::uint32_t times) {
    const T sum = sum_of(sums[totals.index(where.x0, where.y0)], value, times);
    for (std::int32_t y = where.y0; y < where.y1; ++y)
      std::fill_n(sums.begin() + static_cast<std::ptrdiff_t>(totals.index(where.x0, y)), where.width(), sum);
  };
  const std::uint32_t odd = second.empty() ? 0 : samples.end() / 2 - samples.first / 2;
  add_to(totals.color, color, samples.count - odd);
  if (odd > 0) add_to(second, color, odd);
  if (!clear[0].empty()) {
    add_to(clear[0], 1 - covered, samples.count - odd);
    add_to(clear[1], 1 - covered, odd);
  }
  if (!mean.empty() && samples.first == 0) add_to(mean, color, 1);
}

void Sums::copy(const Sums& from, PixelRect where) {
  totals.copy(from.totals, where);
  const auto copy_one = [&](const auto& plane, auto& to) {
    if (!to.empty()) copy_rect(plane, from.rect(), where, to, rect());
  };
  copy_one(from.second, second);
  copy_one(from.mean, mean);
  copy_one(from.squares, squares);
  for (std::size_t half = 0; half < clear.size(); ++half) copy_one(from.clear[half], clear[half]);
}

std::uint64_t Sums::bytes_per_pixel(const Settings& settings) {
  std::uint64_t bytes = Pixels::bytes_per_pixel(means(settings));
  if (measures_error(settings)) bytes += sizeof(Rgb);
  if (is_on_white(settings)) bytes += 2 * sizeof(float);
  if (settings.aovs.contains(Aov::variance)) bytes += 2 * sizeof(Rgb);
  return bytes;
}

PassWork::PassWork(std::shared_ptr<const Pass> its_pass, PixelRect tile, const Settings& settings)
    : pass(std::move(its_pass)), pixels(tile, settings.aovs), sums(tile, settings) {}

void resolve(const Sums& sums, const Pass& pass, Pixels& out) {
  std::size_t pixel = 0;
  for (std::int32_t y = out.rect.y0; y < out.rect.y1; ++y)
    for (std::int32_t x = out.rect.x0; x < out.rect.x1; ++x, ++pixel) {
      const std::uint32_t samples = pass.of(x, y).end();
      const auto n = static_cast<float>(samples);
      const Rgb total = sums.second.empty() ? sums.totals.color[pixel] : sums.totals.color[pixel] + sums.second[pixel];
      out.color[pixel] = total / n;
      for (const Aov aov : sums.totals.aovs())
        std::visit([&]<typename T>(const std::vector<T>& totals) { divide(totals, pixel, n, out.plane<T>(aov)); },
                   sums.totals.values(aov));
      out.record(Aov::sample_count, pixel, samples);
      if (samples > 1 && !sums.squares.empty()) out.record(Aov::variance, pixel, sums.squares[pixel] / n / (n - 1));
    }
}

}  // namespace tessera
