#include "server/job_runner.h"

#include <atomic>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/render/render.h"

namespace tessera::server {

/// A job's work in progress: owned by the units of work that are still to be done, so gone when there are none.
struct JobRunner::Run {
  explicit Run(StructureCache& cache) : structures(cache) {}
  Run(const Run&) = delete;
  ~Run() {
    try {
      if (structure) structures.recount(scene_hash, structure);
    } catch (const std::bad_alloc&) {  // The next job with this structure has it counted.
    }
  }

  /// The structure as it is by now.
  std::optional<StructureUse> structure_use() const {
    if (!structure) return std::nullopt;
    const AccelStats stats = structure->accel->stats();
    return StructureUse{structure->options, stats, structure->build_seconds + stats.mesh_seconds, shares_structure};
  }

  StructureCache& structures;
  JobTable::Admitted job;
  proto::ContentHash scene_hash;
  std::shared_ptr<const Scene> scene;
  Camera camera;
  Settings settings;
  std::unique_ptr<RenderContext> context;      ///< Made by `prepare`, complete and constant from `render` on.
  std::shared_ptr<const Structure> structure;  ///< Null where none is needed.
  bool shares_structure = false;               ///< Another job had it built.
  std::shared_ptr<Film> film;
  std::atomic<std::size_t> tiles_left{0};
};

template <typename Step>
void JobRunner::guard(const Run& run, Step step) {
  try {
    step();
  } catch (const std::bad_alloc&) {
    fail(run.job.id, "the server ran out of memory");
  } catch (const std::exception& error) {
    fail(run.job.id, error.what());
  }
}

void JobRunner::fail(const std::string& id, const char* why) noexcept {
  try {
    jobs_.fail(id, why);
  } catch (const std::bad_alloc&) {  // For the words: short ones take none.
    jobs_.fail(id, "out of memory");
  }
}

void JobRunner::start(const JobTable::Admitted& job, const JobOrder& order, std::shared_ptr<const Scene> scene,
                      const Camera& camera) {
  try {
    auto run = std::make_shared<Run>(structures_);
    run->job = job;
    run->scene_hash = order.scene_hash;
    run->scene = std::move(scene);
    run->camera = camera;
    run->settings = order.settings;
    scheduler_.submit(
        1, [this, run](std::size_t) { guard(*run, [&] { prepare(run); }); }, job.stop);
  } catch (const std::bad_alloc&) {
    fail(job.id, "out of memory");
    throw;
  }
}

void JobRunner::prepare(const std::shared_ptr<Run>& run) {
  if (!jobs_.start_preparing(run->job.id)) return;
  const Settings& settings = run->settings;
  run->context = std::make_unique<RenderContext>(
      RenderContext{run->scene, nullptr, settings, make_plan(*run->scene, run->camera, settings),
                    CameraRays(run->camera, settings.width, settings.height)});
  const auto plan = std::make_shared<const PlanReport>(report(run->context->plan, *run->scene, settings));
  const auto tested = std::make_shared<ObjectMarks>(run->scene->objects.size());
  run->context->tested = tested;
  if (!jobs_.set_plan(run->job.id, plan, tested)) return;
  if (!plan->needs_structure) return render(run);

  const auto traced = [this, run](std::shared_ptr<const Structure> structure, bool shared, std::exception_ptr error) {
    guard(*run, [&] {
      if (error) std::rethrow_exception(error);
      // Another job may have parsed the same document to another object, which the structure knows nothing of.
      run->context->scene = structure->scene;
      run->context->accel = structure->accel;
      run->structure = std::move(structure);
      run->shares_structure = shared;
      render(run);
    });
  };
  structures_.get_or_build(run->scene_hash, run->scene, plan->accel, traced);
}

void JobRunner::render(const std::shared_ptr<Run>& run) {
  // Of a job that ended while it was prepared, the table has given the film's memory to others.
  if (!jobs_.is_unfinished(run->job.id)) return;
  std::vector<PixelRect> tiles;
  for (const Tile& tile : run->context->plan.tiling.tiles) tiles.push_back(tile.rect);
  const std::size_t count = tiles.size();
  run->film = std::make_shared<Film>(run->settings.width, run->settings.height, run->settings.aovs, std::move(tiles));
  run->tiles_left = count;
  if (!jobs_.start_rendering(run->job.id, run->structure_use(), run->film)) return;
  scheduler_.submit(
      count, [this, run](std::size_t i) { guard(*run, [&] { render_one_tile(*run, i); }); }, run->job.stop);
}

void JobRunner::render_one_tile(Run& run, std::size_t index) {
  const auto tile = render_tile(*run.context, index, run.job.stop);
  if (!tile) return;
  run.film->store(index, tile->pixels);
  run.job.progress->add_tile(tile->rays, tile->tests,
                             static_cast<std::uint64_t>(tile->pixels.rect.area()) * run.settings.samples);
  if (--run.tiles_left > 0) return;
  run.film.reset();  // The table's alone now: it can give way as soon as the job has ended.
  jobs_.complete(run.job.id, run.structure_use());
}

}  // namespace tessera::server
