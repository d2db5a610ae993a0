#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/film/convergence.h"
#include "core/film/film.h"
#include "core/film/pass.h"
#include "core/film/sums.h"
#include "core/scene/settings.h"

namespace tessera {

/// What ended the passes over an image: that every pixel has all of its samples, or very many whose halves are equal
/// everywhere; that the error is as small as was asked for; or that the time is over.
enum class EndedBy { samples, error, seconds };

/// How far the passes over an image have come.
struct PassReport {
  std::uint32_t passes = 0;           ///< That are complete.
  std::uint32_t least = 0, most = 0;  ///< Samples of a pixel, by now;
  std::uint64_t samples = 0;          ///< of all pixels together;
  std::uint64_t low_total = 0;        ///< and when the image will be done: between this,
  std::uint64_t high_total = 0;       ///< and this.
  /// Nothing where it isn't measured, or can't be claimed: of few samples, of clamped ones, and where no sample differs
  /// from another, which may also be because none has met what is rare and bright.
  std::optional<ErrorEstimate> error;
  std::optional<EndedBy> ended_by;  ///< Nothing as long as there is a pass to be done.
};

/// The passes over an image, one after the other: a pass is complete when every tile that it renders has been stored,
/// and `next` then settles the one that follows. Which samples that is depends on the settings and on pixels, never on
/// tiles, threads or the order of work; with `seconds`, on the clock as well.
///
/// `work` and `store` may be called by many threads at once, for different tiles; `next` by one, when all have been.
class Passes {
 public:
  /// `is_noiseless`: all samples of a pixel are the same, by the way they are made. Then the error is 0.
  explicit Passes(const Settings& settings, bool is_noiseless = false);

  /// Goes on where other passes over the same image have come to: they had said `report` when they went on to
  /// `current`. All tiles have to be stored as they were then, and those anew that `current` has rendered since, before
  /// anything else is asked.
  Passes(const Settings& settings, bool is_noiseless, Pass current, const PassReport& report);

  const Pass& current() const { return *pass_; }

  /// What the pass asks of a tile that has been stored, here and in `film`, after every pass before, and not after
  /// this.
  PassWork work(PixelRect tile, const Film& film) const;
  void store(const Sums& tile);
  /// Those of a tile; not while it is stored. Empty sums where there is only one pass.
  Sums sums(PixelRect tile) const;
  /// Whether a tile's pixels have as many samples as they may after the pass at hand.
  bool is_last_of(PixelRect tile) const;

  /// Goes on to the next pass, `seconds` after the first one was begun. False when there is none: then the image is
  /// done.
  bool next(double seconds);

  /// Up to the last pass that is complete.
  const PassReport& report() const { return report_; }

  /// Bytes of what is kept of an image between passes.
  static std::uint64_t memory_bytes(const Settings& settings);

 private:
  std::optional<Pass> pass_after(double seconds);
  void take_stock();
  /// Whether there are samples enough for the error that they show to be believed.
  bool is_safe() const;
  /// Whether an error that was asked for will hardly ever be known, as there is no noise to be seen.
  bool is_hopeless() const;
  void look_at_error();

  Settings settings_;
  bool is_noiseless_;
  std::shared_ptr<const Pass> pass_;
  std::optional<Sums> sums_;  ///< Of the whole image; nothing where there is only one pass.
  std::optional<Convergence> convergence_;
  PassReport report_;
};

}  // namespace tessera
