#include "core/film/convergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace tessera {
namespace {

using Triple = std::array<double, 3>;

/// What keeps relMSE finite where an image is black: part of its definition.
constexpr double kRelMseOffset = 0.01;

/// Of 95 in 100, for a normal distribution.
constexpr double kDeviations = 1.96;

/// By so many deviations, of its own noise and theirs, a pixel may differ from its neighbours and still be taken for
/// one of them. The noise of a pixel is known from one difference: a lone bright sample in either half puts the pixel
/// off by one such deviation exactly, so that this has to be more; but the more it is, the more is smoothed across
/// edges.
constexpr double kSameDeviations = 1.5;

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

/// The estimates of a row after the other, and of those above and below it. What lies outside the image is NaN.
class Rows {
 public:
  Rows(const Sums& sums, const Pass& done) : sums_(sums), done_(done) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(done.width) + 2, {{kNaN, kNaN, kNaN}, {}});
    outside_ = rows_[0];
    load(0);
  }

  /// Goes to row `y`, which is 0 or the one that follows.
  void go_to(std::int32_t y) {
    if (y + 1 < done_.height) load(y + 1);
    for (const std::int32_t dy : {-1, 0, 1}) {
      const bool is_inside = y + dy >= 0 && y + dy < done_.height;
      near_[static_cast<std::size_t>(dy + 1)] = (is_inside ? row(y + dy) : outside_).data() + 1;
    }
  }

  /// The pixel that lies so far, 1 at most, from one of this row.
  const Estimate& at(std::int32_t x, std::int32_t dx = 0, std::int32_t dy = 0) const {
    return near_[static_cast<std::size_t>(dy + 1)][x + dx];
  }

 private:
  std::vector<Estimate>& row(std::int32_t y) { return rows_[static_cast<std::size_t>(y % 3)]; }

  void load(std::int32_t y) {
    const std::size_t first = sums_.totals.index(0, y);
    for (std::int32_t x = 0; x < done_.width; ++x) {
      const std::size_t pixel = first + static_cast<std::size_t>(x);
      row(y)[static_cast<std::size_t>(x) + 1] =
          estimate_of(on_white(sums_.totals.color, 0, pixel), on_white(sums_.second, 1, pixel), done_.of(x, y).end());
    }
  }

  Rgb on_white(const std::vector<Rgb>& color, std::size_t half, std::size_t pixel) const {
    const std::vector<float>& clear = sums_.clear[half];
    return clear.empty() ? color[pixel] : color[pixel] + Rgb{1, 1, 1} * clear[pixel];
  }

  const Sums& sums_;
  const Pass& done_;
  std::array<std::vector<Estimate>, 3> rows_;
  std::vector<Estimate> outside_;
  std::array<const Estimate*, 3> near_{};
};

/// Two guesses of something, between which it is expected.
struct Guesses {
  double low = 0, high = 0;

  double middle() const { return (low + high) / 2; }
};

/// A pixel's part of relMSE, summed over its channels. Its variance isn't biased, but the converged colour that the
/// denominator is made of has to be guessed, from the pixel and from those about it that may well be the same. A guess
/// that has the pixel's own noise in it is bright just where the variance is large: the term comes out too small. One
/// that leaves it out has nothing to do with the variance; but it has the others' noise, and as 1/x² is convex, the
/// term comes out too large. Unless the pixel lies in a crease, darker than all about it: then what it shows itself is
/// nearer to the truth.
///
/// Neighbours count in pairs that face each other, so that a slope doesn't matter, and as far as noise explains what
/// the middle of a pair differs by: pairs across an edge don't, the one along it does.
Guesses term_of(const Rows& rows, std::int32_t x) {
  constexpr std::array<std::array<std::int32_t, 2>, 4> kDirections{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  const Estimate& pixel = rows.at(x);
  if (pixel.variance == Triple{}) return {};
  Guesses term;
  for (std::size_t c = 0; c < 3; ++c) {
    const double own = pixel.color[c], variance = pixel.variance[c];
    double others = 0, count = 0;
    for (const auto [dx, dy] : kDirections) {
      const Estimate &one = rows.at(x, dx, dy), &other = rows.at(x, -dx, -dy);
      const double sum = one.color[c] + other.color[c], off = sum / 2 - own;
      const double noise = variance + (one.variance[c] + other.variance[c]) / 4;
      const bool is_same = off * off <= kSameDeviations * kSameDeviations * noise;
      others += is_same ? sum : 0;
      count += is_same ? 2 : 0;
    }
    const double with_own = (own + others) / (1 + count), without = count == 0 ? own : others / count;
    const double bright = std::max(with_own, without), dark = std::min(own, without);
    term.low += variance / (bright * bright + kRelMseOffset);
    term.high += variance / (dark * dark + kRelMseOffset);
  }
  return term;
}

/// Of the terms of pixels, each the sum over its channels.
struct Moments {
  Guesses sum;
  double squares = 0;

  void add(const Guesses& term) {
    sum.low += term.low;
    sum.high += term.high;
    squares += term.middle() * term.middle();
  }
};

/// How far beyond 1 the quotient of two independent sums of squares of normal numbers with so many degrees of freedom
/// lies in 2.5 of 100 cases, by its root. The quotient's distribution is F's, which Student's t gives where both have
/// the same degrees (Cacoullos 1965), and t is expanded about the normal distribution (Fisher & Cornish 1960): 1% short
/// at three degrees.
double quotient_of(double freedom) {
  // Of Student's t with one, two and three degrees, between which the expansion falls short.
  constexpr double kOne = 12.706, kTwo = 4.303, kThree = 3.182;
  const double z = kDeviations, z2 = z * z, n = freedom;
  const double t = z * (1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
                        (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n));
  const double of_few = n < 2 ? kTwo + (kOne - kTwo) * (2 / n - 1) : kThree + (kTwo - kThree) * (6 / n - 2);
  const double u = (n < 3 ? std::max(t, of_few) : t) / std::sqrt(n);
  return u + std::sqrt(u * u + 1);
}

/// The estimate of relMSE, E, and the true one, T, are means over pixels of (a − b)²/4 and (a + b)²/4, where a and b
/// are what the halves are off by, each by its denominator. Of normal noise they are independent, and their quotient's
/// distribution is F's. With degrees of freedom after Satterthwaite (1946): as many as give the variance of E − T, the
/// mean of a·b, which is a sum of products of variances of a and b. Of any noise whatever that is at most twice the sum
/// of the terms' squares, which is reached where a sample falls on one or the other side of an edge; one term alone has
/// one degree. Channels go together, as if they all had the same noise.
ErrorEstimate interval(const Moments& m, double values) {
  const double sum = m.sum.middle();
  if (sum == 0) return {};
  const double factor = quotient_of(2 * sum * sum / m.squares - 1);
  return {std::sqrt(sum / values), std::sqrt(m.sum.low / values) / factor, std::sqrt(m.sum.high / values) * factor};
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
    for (std::int32_t x = 0; x < done.width; ++x) {
      const Guesses pixel = term_of(rows, x);
      moments.add(pixel);
      out.blocks[first_block + static_cast<std::size_t>(x / Pass::kBlock)] += pixel.middle();
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
