#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/integrator/integrator.h"
#include "core/render/render.h"
#include "core/render/sample_order.h"
#include "core/screen/camera_batch.h"

namespace tessera {

/// One pass of a tile being rendered, or a part of it, a chunk of its samples at a time. The result is the same
/// wherever it is interrupted, whatever threads it goes on in, one at a time, and however it is split.
class TileRenderer {
 public:
  using Clock = std::chrono::steady_clock;

  /// For tile `index` of the plan. The context has to outlive this.
  TileRenderer(const RenderContext& context, std::size_t index, PassWork work);
  TileRenderer(const TileRenderer&) = delete;

  /// Goes on until all is done, or the turn is over; by one batch of rays at least. It asks after each. Whether all is
  /// done.
  bool go_on(const std::function<bool()>& is_over);

  /// Leaves the latter half of the samples that haven't been begun to another one, which may be at work at the same
  /// time. The tile is done when both are. Null where it isn't worth it, or where what is counted depends on which rays
  /// go together.
  std::unique_ptr<TileRenderer> split();

  /// To be called once all is done, and once. Whether the tile is: true for the last of its parts.
  bool finish();
  /// What the tile has come to, once it is done.
  const TileResult& result() const { return shared_->result; }
  TileResult take_result() { return std::move(shared_->result); }

  // What this part has done so far.
  const RayCounts& rays() const { return rays_; }
  const TestCounts& tests() const { return tests_; }
  std::uint64_t samples_done() const { return samples_done_; }

 private:
  /// What parts of a tile add to: each has pixels of its own.
  struct Shared {
    std::shared_ptr<const Pass> pass;
    TileResult result;  ///< Its pixels are made of its sums when all is traced.
    std::mutex mutex = {};
    std::size_t parts = 1;  ///< That aren't done.
  };

  TileRenderer(const RenderContext& context, std::size_t index, std::shared_ptr<Shared> shared, SampleOrder order);
  void fill_with_background();
  std::size_t samples_at_once() const;
  /// Has the job's chunks grow or shrink by what this one's batches have taken.
  void fit_chunks();
  void begin_chunk();
  void end_chunk();
  void trace_first_level();
  void record_aovs();
  void record_albedo(std::size_t at, const Ray& ray, const Hit& hit);
  void record_costs(std::size_t at);
  std::size_t pixel(const SampleId& sample) const { return pixels_.index(sample.x, sample.y); }

  const RenderContext& context_;
  const std::size_t index_;
  const Tile& tile_;
  const std::shared_ptr<Shared> shared_;
  Pixels& pixels_;
  Sums& sums_;
  SampleOrder order_;
  Candidates candidates_;
  RayCounts rays_;
  TestCounts tests_;
  TraceLog log_;
  std::unique_ptr<Integrator> integrator_;  ///< Unless all pixels of the tile are the same.
  TestCounts before_chunk_;
  std::uint64_t samples_done_ = 0;
  // Of the chunk at hand; empty between two.
  Clock::duration longest_batch_{};
  std::vector<SampleId> samples_;
  CameraBatch camera_;
  std::vector<Hit> hits_;
  std::vector<Rgb> radiance_;
  std::vector<float> covered_;
};

}  // namespace tessera
