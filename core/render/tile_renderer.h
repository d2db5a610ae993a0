#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "core/integrator/integrator.h"
#include "core/render/render.h"
#include "core/render/sample_order.h"
#include "core/screen/camera_batch.h"

namespace tessera {

/// One pass of a tile being rendered, a chunk of its samples at a time. The result is the same wherever it is
/// interrupted, and whatever threads it goes on in; one at a time.
class TileRenderer {
 public:
  using Clock = std::chrono::steady_clock;

  /// For tile `index` of the plan. The context has to outlive this.
  TileRenderer(const RenderContext& context, std::size_t index, PassWork work);
  TileRenderer(const TileRenderer&) = delete;

  /// Goes on until the tile is done, or the turn is over; by one batch of rays at least. It asks after each. Whether
  /// the tile is done.
  bool go_on(const std::function<bool()>& is_over);

  /// What has been done so far; pixels mean nothing until the tile is done.
  const TileResult& result() const { return result_; }
  TileResult take_result() { return std::move(result_); }
  std::uint64_t samples_done() const { return samples_done_; }

 private:
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
  std::size_t pixel(const SampleId& sample) const { return result_.pixels.index(sample.x, sample.y); }

  const RenderContext& context_;
  const Tile& tile_;
  std::shared_ptr<const Pass> pass_;
  SampleOrder order_;
  Candidates candidates_;
  TileResult result_;  ///< Its pixels are made of its sums when all is traced.
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
