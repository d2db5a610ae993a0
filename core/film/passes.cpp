#include "core/film/passes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tessera {
namespace {

/// Samples that every pixel has, and the image, before its error is believed: in few of them, what is rare and bright
/// may not have been seen anywhere. That holds for images that are to have no more of them as well.
constexpr std::uint64_t kSafePerPixel = 16;
constexpr std::uint64_t kSafeInAll = 1 << 18;

/// So many times as many, and halves that are equal everywhere: what has not been seen by then hardly ever will be, and
/// more samples don't bring the error any nearer to being known.
constexpr std::uint64_t kHopeless = 16;

/// Of the time that is left, the part that a pass is meant to take: the rest is for what it takes longer.
constexpr double kUsedTime = 0.9;

/// A pass of less than this, a pixel, isn't worth looking at every one of them again.
constexpr double kLeastPass = 1.0 / 8;

/// How many samples all pixels have after the pass that follows `n` of them, where none looks at the error: few passes,
/// but the first image after one sample.
double next_plain(double n) { return n < 64 ? 4 * n : 1.5 * n; }

std::uint64_t pixels_of(const Settings& settings) { return std::uint64_t{settings.width} * settings.height; }

/// A pixel's part of those.
std::uint64_t safe_samples(const Settings& settings) {
  const std::uint64_t pixels = pixels_of(settings);
  return std::max(kSafePerPixel, (kSafeInAll + pixels - 1) / pixels);
}

std::uint64_t capped(double samples, std::uint64_t most) {
  return samples >= static_cast<double>(most) ? most : static_cast<std::uint64_t>(samples);
}

}  // namespace

Passes::Passes(const Settings& settings, bool is_noiseless)
    : settings_(settings),
      is_noiseless_(is_noiseless),
      pass_(std::make_shared<const Pass>(settings.width, settings.height, SampleRange{0, 1})) {
  if (settings.samples > 1) sums_.emplace(PixelRect{0, 0, pass_->width, pass_->height}, settings);
  report_.high_total = pixels_of(settings) * settings.samples;
  report_.low_total = measures_error(settings) ? pixels_of(settings) : report_.high_total;
}

Passes::Passes(const Settings& settings, bool is_noiseless, Pass current, const PassReport& report)
    : Passes(settings, is_noiseless) {
  pass_ = std::make_shared<const Pass>(std::move(current));
  report_ = report;
}

PassWork Passes::work(PixelRect tile, const Film& film) const {
  PassWork work(pass_, tile, settings_);
  if (report_.passes == 0) return work;
  work.pixels.copy(film.pixels(), tile);
  work.sums.copy(*sums_, tile);
  return work;
}

void Passes::store(const Sums& tile) {
  if (sums_) sums_->copy(tile, tile.rect());
}

Sums Passes::sums(PixelRect tile) const {
  Sums sums(tile, settings_);
  if (sums_) sums.copy(*sums_, tile);
  return sums;
}

bool Passes::is_last_of(PixelRect tile) const {
  bool is_last = true;
  pass_->for_blocks_in(tile, [&](PixelRect, const SampleRange& range) { is_last &= range.end() == settings_.samples; });
  return is_last;
}

bool Passes::next(double seconds) {
  take_stock();
  auto next = pass_after(seconds);
  if (!next) {
    report_.low_total = report_.high_total = report_.samples;
    return false;
  }
  pass_ = std::make_shared<const Pass>(*std::move(next));
  return true;
}

void Passes::take_stock() {
  ++report_.passes;
  report_.samples = 0;
  report_.least = settings_.samples;
  report_.most = 0;
  for (std::size_t block = 0; block < pass_->blocks.size(); ++block) {
    const std::uint32_t samples = pass_->blocks[block].end();
    report_.least = std::min(report_.least, samples);
    report_.most = std::max(report_.most, samples);
    report_.samples += static_cast<std::uint64_t>(pass_->rect_of(block).area()) * samples;
  }
  if (is_noiseless_ || is_safe()) look_at_error();
}

bool Passes::is_safe() const { return report_.least >= safe_samples(settings_); }

bool Passes::is_hopeless() const {
  return settings_.error && convergence_ && convergence_->estimate.error == 0 &&
         report_.least >= kHopeless * safe_samples(settings_);
}

void Passes::look_at_error() {
  if (!measures_error(settings_)) return;
  std::optional<ErrorEstimate> estimate;
  if (is_noiseless_) {
    estimate.emplace();
  } else if (sums_ && (convergence_ = measure(*sums_, *pass_)) && convergence_->estimate.error > 0) {
    estimate = convergence_->estimate;
  }
  report_.error = std::isinf(settings_.clamp) ? estimate : std::nullopt;
}

std::optional<Pass> Passes::pass_after(double seconds) {
  const auto end = [&](EndedBy by) -> std::optional<Pass> {
    report_.ended_by = by;
    return std::nullopt;
  };
  const std::uint64_t pixels = pixels_of(settings_), most = pixels * settings_.samples;
  if (report_.samples == most || is_hopeless()) return end(EndedBy::samples);
  if (settings_.error && report_.error && report_.error->high <= *settings_.error) return end(EndedBy::error);
  if (settings_.seconds && seconds >= *settings_.seconds) return end(EndedBy::seconds);

  const double done = static_cast<double>(report_.samples), n = done / static_cast<double>(pixels);
  double total = measures_error(settings_) ? 2 * n : next_plain(n);
  report_.low_total = report_.high_total = most;
  if (settings_.error && report_.error) {
    // Errors fall with the root of the number of samples, or with well-spread ones up to as fast as the number grows.
    const double asked = *settings_.error;
    const double low = done * std::max(1.0, report_.error->low / asked);
    const double high = done * std::max(1.0, (report_.error->high / asked) * (report_.error->high / asked));
    report_.low_total = capped(low, most);
    report_.high_total = capped(high, most);
    total = std::clamp(high / static_cast<double>(pixels), 1.125 * n, 2 * n);
  }
  double budget = total * static_cast<double>(pixels) - done;
  if (settings_.seconds) {
    const double in_time = done / seconds * *settings_.seconds;
    report_.high_total = std::min(report_.high_total, capped(std::max(in_time, done), most));
    report_.low_total = settings_.error ? std::min(report_.low_total, report_.high_total) : report_.high_total;
    budget = std::min(budget, kUsedTime * (in_time - done));
    if (budget < kLeastPass * static_cast<double>(pixels)) return end(EndedBy::seconds);
  }
  const bool by_block = measures_error(settings_) && settings_.adaptive && convergence_;
  if (by_block) {
    const auto samples =
        distribute(convergence_->blocks, *pass_, static_cast<std::uint64_t>(budget), settings_.samples);
    Pass next = *pass_;
    for (std::size_t block = 0; block < samples.size(); ++block)
      next.blocks[block] = {pass_->blocks[block].end(), samples[block] - pass_->blocks[block].end()};
    if (std::ranges::any_of(next.blocks, [](const SampleRange& range) { return range.count > 0; })) return next;
  }
  // All alike. In pairs, from the second one on: one for each half.
  auto more = static_cast<std::uint32_t>(std::min<double>(settings_.samples, budget / static_cast<double>(pixels)));
  if (measures_error(settings_) && more > 1) more -= more % 2;
  if (more == 0) {
    assert(settings_.seconds && "only time makes a pass smaller than one sample of each pixel");
    return end(EndedBy::seconds);
  }
  Pass next = *pass_;
  for (SampleRange& range : next.blocks) range = {range.end(), std::min(more, settings_.samples - range.end())};
  return next;
}

std::uint64_t Passes::memory_bytes(const Settings& settings) {
  return settings.samples > 1 ? pixels_of(settings) * Sums::bytes_per_pixel(settings) : 0;
}

}  // namespace tessera
