#include "core/film/convergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace tessera {
namespace {

using Triple = std::array<double, 3>;

/// What keeps relMSE finite where an image is black: part of its definition.
constexpr double kRelMseOffset = 0.01;

/// Of 95 in 100, for a normal distribution.
constexpr double kDeviations = 1.96;
constexpr double kDoubt = 1.25;

/// Of the samples that blocks have on average, a block has this share at least.
constexpr double kLeastShare = 1.0 / 8;
/// A block counts as noisy as its neighbours are on average, times this, if that is more than it shows itself.
constexpr double kNeighboursShare = 0.25;

/// A pixel's colour, and the variance of that by the difference of its halves.
struct Estimate {
  Triple color{}, variance{};
};

Estimate estimate_of(Rgb first, Rgb second, std::uint32_t samples) {
  const double n = samples, a = samples - samples / 2, b = samples / 2;
  const std::array<std::pair<float, float>, 3> sums{{{first.r, second.r}, {first.g, second.g}, {first.b, second.b}}};
  Estimate out;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto [sum_a, sum_b] = sums[c];
    const double difference = sum_a / a - sum_b / b;
    out.color[c] = (double{sum_a} + sum_b) / n;
    out.variance[c] = difference * difference * (a * b / (n * n));
  }
  return out;
}

/// What some pixels have in a channel, summed.
struct Neighbours {
  double count = 0, color = 0, squares = 0, variance = 0;

  void add(const Estimate& pixel, std::size_t channel) {
    count += 1;
    color += pixel.color[channel];
    squares += pixel.color[channel] * pixel.color[channel];
    variance += pixel.variance[channel];
  }
  void add(const Neighbours& others) {
    count += others.count;
    color += others.color;
    squares += others.squares;
    variance += others.variance;
  }
};

/// The estimates of one row after the other, and of each pixel's neighbours.
class Rows {
 public:
  Rows(const Sums& sums, const Pass& done)
      : sums_(sums), done_(done), above_and_below_(static_cast<std::size_t>(done.width)) {
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(done.width));
    load(0);
  }

  /// Goes to row `y`, which is 0 or the one that follows.
  void go_to(std::int32_t y) {
    y_ = y;
    if (y + 1 < done_.height) load(y + 1);
    for (std::size_t x = 0; x < above_and_below_.size(); ++x) {
      above_and_below_[x] = {};
      for (std::size_t c = 0; c < 3; ++c) {
        if (y > 0) above_and_below_[x][c].add(row(y - 1)[x], c);
        if (y + 1 < done_.height) above_and_below_[x][c].add(row(y + 1)[x], c);
      }
    }
  }

  const Estimate& at(std::size_t x) const { return row(y_)[x]; }

  /// Of the up to eight pixels around one of this row.
  Neighbours around(std::size_t x, std::size_t channel) const {
    Neighbours all = above_and_below_[x][channel];
    const auto add = [&](std::size_t beside) {
      all.add(above_and_below_[beside][channel]);
      all.add(row(y_)[beside], channel);
    };
    if (x > 0) add(x - 1);
    if (x + 1 < above_and_below_.size()) add(x + 1);
    return all;
  }

 private:
  const std::vector<Estimate>& row(std::int32_t y) const { return rows_[static_cast<std::size_t>(y % 3)]; }

  void load(std::int32_t y) {
    std::size_t pixel = sums_.totals.index(0, y);
    std::int32_t x = 0;
    for (Estimate& estimate : rows_[static_cast<std::size_t>(y % 3)]) {
      estimate = estimate_of(sums_.totals.color[pixel], sums_.second[pixel], done_.of(x++, y).end());
      ++pixel;
    }
  }

  const Sums& sums_;
  const Pass& done_;
  std::int32_t y_ = 0;
  std::array<std::vector<Estimate>, 3> rows_;
  std::vector<std::array<Neighbours, 3>> above_and_below_;
};

/// What relMSE's denominator is made of: the pixel's converged colour, as far as that can be told. The pixel's own
/// colour is bright just where its noise is, so that its error would look smaller than it is; what its neighbours show
/// has noise of its own. The colour is drawn towards theirs as far as noise explains their differences (James & Stein
/// 1961).
double reference(const Estimate& own, const Neighbours& others, std::size_t channel) {
  if (others.count < 2) return own.color[channel];
  const double mean = others.color / others.count,
               noise = (own.variance[channel] + others.variance) / (others.count + 1);
  const double spread = std::max(others.squares - others.color * mean, 1e-300) / (others.count - 1);
  return own.color[channel] + std::min(1.0, noise / spread) * (mean - own.color[channel]);
}

/// Of the terms of pixels, each the sum over its channels.
struct Moments {
  double sum = 0, squares = 0;
  /// Of what denominators may be off by: as much as the noise that they are made with, and of pixels that are all noise
  /// by a factor that isn't known.
  double doubtful = 0;

  void add(double term) {
    sum += term;
    squares += term * term;
    doubtful += term * term / (1 + term);
  }
};

/// The estimate of relMSE, E, and the true one, T, are means over pixels of (a − b)²/4 and (a + b)²/4, where a and b
/// are what the halves are off by, each by its denominator. So they differ by the mean of a·b, whose variance is a sum
/// of those of a times those of b: of normal noise, 4/3 of the sum of the estimates' squares, and less of any noise
/// with longer tails, as the rare bright sample is in E and T alike. Channels go together, as if they all had the same
/// noise. The interval is symmetric in the logarithm, as neither can be negative.
ErrorEstimate interval(const Moments& m, double values) {
  if (m.sum == 0) return {};
  const double error = std::sqrt(m.sum / values);
  const double deviation = std::sqrt(4.0 / 3 * m.squares) / m.sum, doubt = m.doubtful / m.sum;
  const double factor = std::exp((kDeviations * deviation + kDoubt * doubt) / 2);
  return {error, error / factor, error * factor};
}

/// Of blocks around a block, itself left out.
double mean_of_neighbours(const std::vector<double>& blocks, const Pass& image, std::size_t block) {
  const std::int32_t across = image.columns(), down = image.rows();
  const auto x = static_cast<std::int32_t>(block) % across, y = static_cast<std::int32_t>(block) / across;
  double sum = 0, count = 0;
  for (std::int32_t v = std::max(y - 1, 0); v <= std::min(y + 1, down - 1); ++v)
    for (std::int32_t u = std::max(x - 1, 0); u <= std::min(x + 1, across - 1); ++u) {
      if (u == x && v == y) continue;
      sum += blocks[static_cast<std::size_t>(v) * static_cast<std::size_t>(across) + static_cast<std::size_t>(u)];
      count += 1;
    }
  return count == 0 ? 0 : sum / count;
}

}  // namespace

std::optional<Convergence> measure(const Sums& sums, const Pass& done) {
  if (sums.second.empty()) return std::nullopt;
  if (std::ranges::any_of(done.blocks, [](const SampleRange& range) { return range.end() < 2; })) return std::nullopt;
  Convergence out;
  out.blocks.resize(done.blocks.size());
  Rows rows(sums, done);
  Moments moments;
  for (std::int32_t y = 0; y < done.height; ++y) {
    rows.go_to(y);
    const auto first_block = static_cast<std::size_t>(y / Pass::kBlock) * static_cast<std::size_t>(done.columns());
    for (std::size_t x = 0; x < static_cast<std::size_t>(done.width); ++x) {
      const Estimate& own = rows.at(x);
      double pixel = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        if (own.variance[c] == 0) continue;
        const double color = reference(own, rows.around(x, c), c);
        pixel += own.variance[c] / (color * color + kRelMseOffset);
      }
      moments.add(pixel);
      out.blocks[first_block + x / Pass::kBlock] += pixel;
    }
  }
  for (std::size_t block = 0; block < out.blocks.size(); ++block)
    out.blocks[block] /= 3 * static_cast<double>(done.rect_of(block).area());
  out.estimate = interval(moments, 3.0 * done.width * done.height);
  return out;
}

std::vector<std::uint32_t> distribute(const std::vector<double>& blocks, const Pass& done, std::uint64_t budget,
                                      std::uint32_t most) {
  const std::size_t count = blocks.size();
  std::vector<double> per_sample(count), wanted(count), area(count);
  double spent = 0, pixels = 0;
  for (std::size_t b = 0; b < count; ++b) {
    area[b] = static_cast<double>(done.rect_of(b).area());
    per_sample[b] = blocks[b] * done.blocks[b].end();
    spent += area[b] * done.blocks[b].end();
    pixels += area[b];
  }
  // Errors fall with the number of samples, so that the sum of errors is smallest, for so many of them, where each
  // block has as many as the root of what one of its samples brings.
  double greatest = 0;
  for (std::size_t b = 0; b < count; ++b) {
    wanted[b] = std::sqrt(std::max(per_sample[b], kNeighboursShare * mean_of_neighbours(per_sample, done, b)));
    greatest = std::max(greatest, wanted[b]);
  }
  const double all = spent + static_cast<double>(budget), least = all / pixels * kLeastShare;
  const auto samples_at = [&](std::size_t b, double scale) {
    return std::max<double>(done.blocks[b].end(), std::min<double>(most, std::max(least, scale * wanted[b])));
  };
  double low = 0, high = greatest == 0 ? 0 : 1;
  const auto total_at = [&](double scale) {
    double total = 0;
    for (std::size_t b = 0; b < count; ++b) total += area[b] * samples_at(b, scale);
    return total;
  };
  if (greatest > 0) high = most / greatest;
  for (int step = 0; step < 60; ++step) {
    const double middle = std::midpoint(low, high);
    (total_at(middle) < all ? low : high) = middle;
  }
  std::vector<std::uint32_t> samples(count);
  for (std::size_t b = 0; b < count; ++b) {
    const std::uint32_t there = done.blocks[b].end();
    // In pairs, one for each half; and not in driblets, which would be a pass for little.
    const auto target = static_cast<std::uint32_t>(std::min<double>(most, 2 * std::ceil(samples_at(b, high) / 2)));
    samples[b] = target - there < std::max<std::uint32_t>(2, there / 16) ? there : target;
  }
  return samples;
}

}  // namespace tessera
