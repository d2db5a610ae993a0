#include "server/jobs/job_runner.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "core/accel/build_stop.h"
#include "core/film/passes.h"
#include "core/render/tile_renderer.h"
#include "server/metrics/metrics.h"
#include "server/store/tile_log.h"

namespace tessera::server {
namespace {

/// Of a job that takes no longer, tiles aren't kept: rendering them again is no loss.
constexpr std::chrono::seconds kWorthLogging{1};

constexpr std::chrono::milliseconds kTryToKeepAgain{200};

/// Short enough for a string that takes no memory.
constexpr const char* kOutOfMemory = "out of memory";

/// Whether there is no light, or none is followed.
bool is_dark(const Plan& plan) {
  const Features& has = plan.features;
  if (plan.integrator == IntegratorKind::none) return true;
  return plan.integrator != IntegratorKind::ambient_occlusion && has.lights == 0 && !has.emitters && !has.unlit &&
         !has.sky && has.only_physical;
}

/// Whether an AOV is asked for that is a mean over samples.
bool asks_for_means(const Settings& settings) {
  return std::ranges::any_of(settings.aovs, [](Aov aov) { return aov_entry(aov).origin == AovOrigin::mean; });
}

std::uint64_t broken_textures(const Scene& scene) {
  std::set<const TextureImage*> broken;
  for (const Texture& texture : scene.textures)
    if (!texture.image->problem().empty()) broken.insert(texture.image.get());
  return broken.size();
}

/// Whether no sample of a pixel can differ from another: nothing is drawn for any, nothing is to be seen but a sky that
/// is the same everywhere, or all is black, and opaque.
bool is_noiseless(const RenderContext& context) {
  const Plan& plan = context.plan;
  if (is_dark(plan) && !context.settings.transparent && !asks_for_means(context.settings)) return true;
  const auto is_empty = [](const Tile& tile) { return tile.first_level == FirstLevel::nothing; };
  if (std::ranges::all_of(plan.tiling.tiles, is_empty) && !plan.features.ground)
    return context.settings.transparent || plan.features.even_sky;
  return plan.integrator == IntegratorKind::whitted && !context.settings.jitter && !context.rays.has_lens();
}

/// Puts tiles in an order in which the first of them, however many, lie all over the image: they cost what the others
/// will, so that it can be said how long it takes. (Steps of the golden ratio around a circle never leave a wide gap.)
void spread(std::vector<std::size_t>& tiles) {
  const std::size_t count = tiles.size();
  auto step = static_cast<std::size_t>(0.618 * static_cast<double>(count)) | 1;
  while (std::gcd(step, count) > 1) step += 2;
  std::vector<std::size_t> spread;
  spread.reserve(count);
  for (std::size_t i = 0, at = 0; i < count; ++i, at = (at + step) % count) spread.push_back(tiles[at]);
  tiles = std::move(spread);
}

}  // namespace

/// A tile being rendered, or a part of it, and what of that the job's progress has been told.
struct JobRunner::OpenTile {
  using Spent = std::atomic<std::chrono::steady_clock::rep>;

  OpenTile(const RenderContext& context, std::size_t of, PassWork work)
      : index(of), renderer(std::make_unique<TileRenderer>(context, of, std::move(work))) {}
  OpenTile(const OpenTile& whole, std::unique_ptr<TileRenderer> part)
      : index(whole.index), renderer(std::move(part)), spent(whole.spent) {}

  void tell(Progress& progress) {
    const Progress::Done now{renderer->rays(), renderer->tests(), renderer->samples_done()};
    progress.add(now, told);
    metrics().add_rays(now.rays, told.rays);
    told = now;
  }

  const std::size_t index;
  const std::unique_ptr<TileRenderer> renderer;
  Progress::Done told;
  const std::shared_ptr<Spent> spent = std::make_shared<Spent>(0);  ///< Rendering all parts.
};

/// Tiles between two turns, by index. For any number of threads.
class JobRunner::PausedTiles {
 public:
  using Tiles = std::map<std::size_t, OpenTile>;

  /// The tile that was put, if it was.
  Tiles::node_type take(std::size_t index) {
    const std::lock_guard lock(mutex_);
    return tiles_.extract(index);
  }

  void put(Tiles::node_type tile) {
    const std::lock_guard lock(mutex_);
    tiles_.insert(std::move(tile));
  }

 private:
  std::mutex mutex_;
  Tiles tiles_;
};

/// A job's work in progress: owned by the units of work that are still to be done, so gone when there are none.
struct JobRunner::Run {
  Run(StructureCache& cache, JobTable& table) : structures(cache), jobs(table) {}
  Run(const Run&) = delete;
  ~Run() {
    if (log && !jobs.goes_on_later(job.id)) log->remove();
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

  PausedTiles::Tiles::node_type take_or_open(std::size_t index) {
    if (auto tile = paused.take(index)) return tile;
    PausedTiles::Tiles opened;
    opened.try_emplace(index, *context, index, passes->work(context->plan.tiling.tiles[index].rect, *film));
    return opened.extract(opened.begin());
  }

  StructureCache& structures;
  JobTable& jobs;
  JobTable::Admitted job;
  Scheduler::Job turns;
  proto::ContentHash scene_hash;
  std::shared_ptr<const Scene> scene;
  Camera camera;
  Settings settings;
  std::unique_ptr<RenderContext> context;      ///< Made by `prepare`, complete and constant from `render` on.
  std::shared_ptr<const Structure> structure;  ///< Null where none is needed.
  bool shares_structure = false;               ///< Another job had it built.
  StructureCache::Asking asking;               ///< For it.
  std::shared_ptr<Film> film;
  std::optional<Passes> passes;
  std::optional<TileLog> log;
  CoreSeconds told;                                 ///< To the job's progress.
  std::chrono::steady_clock::time_point rendering;  ///< Since when.
  // Of the pass at hand:
  std::chrono::steady_clock::time_point pass_begun;
  std::vector<std::size_t> tiles;
  PausedTiles paused;
  std::atomic<std::size_t> tiles_left{0};
};

template <typename Step>
void JobRunner::guard(const std::string& job, Step step) noexcept {
  try {
    try {
      step();
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      jobs_.fail(job, error.what());
    }
  } catch (const std::bad_alloc&) {
    jobs_.fail(job, kOutOfMemory);
  }
}

void JobRunner::start(const JobTable::Admitted& job, const JobOrder& order, std::shared_ptr<const Scene> scene,
                      const Camera& camera) {
  guard(job.id, [&] {
    auto run = std::make_shared<Run>(structures_, jobs_);
    run->job = job;
    run->turns = scheduler_.open({order.owner, order.priority});
    run->scene_hash = order.scene_hash;
    run->scene = std::move(scene);
    run->camera = camera;
    run->settings = order.settings;
    const auto prepare_it = [this, run](std::size_t, const Scheduler::Turn&) {
      guard(run->job.id, [&] { prepare(run); });
      return true;
    };
    scheduler_.submit(run->turns, 1, prepare_it, job.stop);
  });
}

void JobRunner::prepare(const std::shared_ptr<Run>& run) {
  if (!jobs_.start_preparing(run->job.id)) return;
  const Settings& settings = run->settings;
  run->context =
      std::make_unique<RenderContext>(run->scene, nullptr, settings, make_plan(*run->scene, run->camera, settings),
                                      CameraRays(run->camera, settings.width, settings.height), nullptr);
  const auto plan = std::make_shared<const PlanReport>(report(run->context->plan, *run->scene, settings));
  const auto tested = std::make_shared<ObjectMarks>(run->scene->objects.size());
  run->context->tested = tested;
  if (!jobs_.set_plan(run->job.id, plan, tested)) return;
  if (needs_structure(run->context->plan)) return find_structure(run);
  if (needs_lights(run->context->plan)) run->context->lights = make_lights(run->scene);
  render(run);
}

void JobRunner::find_structure(const std::shared_ptr<Run>& run) {
  const auto traced = [this, run](std::shared_ptr<const Structure> structure, bool shared, std::exception_ptr error) {
    guard(run->job.id, [&] {
      if (error) std::rethrow_exception(error);
      // Another job may have parsed the same document to another object, which the structure knows nothing of.
      run->context->scene = structure->scene;
      run->context->accel = structure->accel;
      run->structure = std::move(structure);
      run->shares_structure = shared;
      if (!needs_lights(run->context->plan)) return render(run);
      // Not at once: others who wait for the structure are told by this thread.
      const auto light_it = [this, run](std::size_t, const Scheduler::Turn&) {
        guard(run->job.id, [&] {
          run->context->lights = run->structure->lights->get(run->structure->scene);
          render(run);
        });
        return true;
      };
      scheduler_.submit(run->turns, 1, light_it, run->job.stop);
    });
  };
  run->asking = structures_.get_or_build(run->scene_hash, run->scene, run->context->plan.accel, traced, run->job.stop);
}

void JobRunner::render(const std::shared_ptr<Run>& run) {
  // Of a job that ended while it was prepared, the table has given the film's memory to others.
  if (!jobs_.is_unfinished(run->job.id)) return;
  std::vector<PixelRect> tiles;
  for (const Tile& tile : run->context->plan.tiling.tiles) tiles.push_back(tile.rect);
  const Settings& settings = run->settings;
  run->film = std::make_shared<Film>(settings.width, settings.height, settings.aovs, tiles);
  run->rendering = clock_();
  if (files_) run->log.emplace(files_->tiles / run->job.id, settings, std::move(tiles));
  const std::vector<bool> is_done = go_on(*run);
  run->job.progress->set_passes(run->passes->report());
  run->job.progress->start_rendering(scheduler_.threads());
  if (!jobs_.start_rendering(run->job.id, run->structure_use(), run->film)) return;
  begin_pass(run, is_done);
}

std::vector<bool> JobRunner::go_on(Run& run) {
  auto stored = run.log ? run.log->load() : std::nullopt;
  if (!stored) {
    run.passes.emplace(run.settings, is_noiseless(*run.context));
    return {};
  }
  const JobFigures& before = stored->figures;
  Progress& progress = *run.job.progress;
  run.passes.emplace(run.settings, is_noiseless(*run.context), stored->current, before.passes);
  run.rendering -=
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(stored->seconds));
  progress.add({before.rays, before.tests, before.samples}, {});
  progress.add_core_seconds(before.cores);
  progress.complete_tiles(before.tiles);
  for (std::size_t i = 0; i < stored->tiles.size(); ++i) {
    const std::unique_ptr<StoredTile>& tile = stored->tiles[i];
    if (!tile) continue;
    run.film->store(i, tile->pixels);
    run.passes->store(tile->sums);
    if (!stored->is_done[i]) continue;
    progress.add(tile->done, {});
    if (run.passes->is_last_of(tile->pixels.rect)) progress.add_tile(tile->pixels.rect);
  }
  spdlog::info("job {}: goes on in pass {}", run.job.id, stored->pass + 1);
  return std::move(stored->is_done);
}

bool JobRunner::is_worth_logging(const Run& run) const {
  return run.log && clock_() - run.rendering > kWorthLogging && jobs_.is_written(run.job.id);
}

void JobRunner::log_pass(Run& run) {
  if (!run.log) return;
  const PassReport& report = run.passes->report();
  if (report.passes > 0 && !is_worth_logging(run)) return run.log->skip();
  const std::chrono::duration<double> spent = clock_() - run.rendering;
  JobFigures figures = run.job.progress->figures();
  figures.passes = report;
  run.log->begin({report.passes, spent.count(), figures, run.passes->current(), {}, {}}, *run.passes, *run.film);
}

void JobRunner::begin_pass(const std::shared_ptr<Run>& run, const std::vector<bool>& done_before) {
  const std::vector<Tile>& tiles = run->context->plan.tiling.tiles;
  if (done_before.empty()) log_pass(*run);
  run->tiles.clear();
  for (std::size_t i = 0; i < tiles.size(); ++i)
    if (run->passes->current().samples_in(tiles[i].rect) > 0 && (done_before.empty() || !done_before[i]))
      run->tiles.push_back(i);
  if (run->tiles.empty()) return end_pass(run);  // It was done when an earlier daemon ended.
  spread(run->tiles);
  run->tiles_left = run->tiles.size();
  run->pass_begun = std::chrono::steady_clock::now();
  const auto render_it = [this, run](std::size_t index, const Scheduler::Turn& turn) {
    bool is_done = true;
    guard(run->job.id, [&] { is_done = render_tile(run, run->tiles[index], turn); });
    return is_done;
  };
  scheduler_.submit(run->turns, run->tiles.size(), render_it, run->job.stop);
}

bool JobRunner::render_tile(const std::shared_ptr<Run>& run, std::size_t index, const Scheduler::Turn& turn) {
  auto tile = run->take_or_open(index);
  if (render_part(run, tile.mapped(), turn)) return true;
  run->paused.put(std::move(tile));
  return false;
}

bool JobRunner::render_part(const std::shared_ptr<Run>& run, OpenTile& open, const Scheduler::Turn& turn) {
  const BuildStop stop(run->job.stop);  // of meshes that rays come to
  const auto begun = TileRenderer::Clock::now();
  const auto is_over = [&] { return turn.is_over() || run->job.stop.stop_requested(); };
  bool is_done;
  while (!(is_done = open.renderer->go_on([&] { return is_over() || turn.has_idle_threads(); })) && !is_over())
    share(run, open);
  const auto spent = TileRenderer::Clock::now() - begun;
  *open.spent += spent.count();
  run->job.progress->add_thread_time(spent);
  open.tell(*run->job.progress);
  if (is_done && open.renderer->finish()) store(run, open);
  return is_done;
}

void JobRunner::share(const std::shared_ptr<Run>& run, OpenTile& open) {
  auto rest = open.renderer->split();
  if (!rest) return;
  const auto part = std::make_shared<OpenTile>(open, std::move(rest));
  const auto render_it = [this, run, part](std::size_t, const Scheduler::Turn& turn) {
    bool is_done = true;
    guard(run->job.id, [&] { is_done = render_part(run, *part, turn); });
    return is_done;
  };
  scheduler_.submit(run->turns, 1, render_it, run->job.stop);
}

void JobRunner::store(const std::shared_ptr<Run>& run, const OpenTile& done) {
  metrics().tile_time.add(std::chrono::steady_clock::duration(*done.spent));
  const TileResult& result = done.renderer->result();
  const PixelRect rect = result.pixels.rect;
  run->film->store(done.index, result.pixels);
  run->passes->store(result.sums);
  if (is_worth_logging(*run))
    run->log->add(done.index, result.pixels, result.sums,
                  {result.rays, result.tests, run->passes->current().samples_in(rect)});
  if (run->passes->is_last_of(rect)) run->job.progress->add_tile(rect);
  if (--run->tiles_left == 0) end_pass(run);
}

void JobRunner::end_pass(const std::shared_ptr<Run>& run) {
  const std::chrono::duration<double> spent = clock_() - run->rendering;
  metrics().pass_time.add(std::chrono::steady_clock::now() - run->pass_begun);
  const bool goes_on = run->passes->next(spent.count());
  const Scheduler::Spent cores = scheduler_.spent(run->turns);
  run->job.progress->add_core_seconds({cores.busy_seconds - run->told.busy, cores.starved_seconds - run->told.idle});
  run->told = {cores.busy_seconds, cores.starved_seconds};
  run->job.progress->set_passes(run->passes->report());
  if (goes_on) return begin_pass(run);
  run->job.progress->set_broken_textures(broken_textures(*run->context->scene));
  run->job.progress->complete_tiles(run->context->plan.tiling.tiles.size());
  run->film.reset();  // The table's alone now: it can give way as soon as the job has ended.
  run->passes.reset();
  run->job.passes_memory.reset();
  KeptImage image;
  if (files_ && jobs_.is_written(run->job.id))
    if (const auto film = jobs_.film(run->job.id); film && *film) image.for_journal = ImageStore::for_journal(**film);
  if (!jobs_.complete(run->job.id, run->structure_use(), image) && files_) keep_image(run);
}

void JobRunner::keep_image(const std::shared_ptr<Run>& run) {
  const auto keep_it = [this, run, is_told = false](std::size_t, const Scheduler::Turn&) mutable {
    const std::string& id = run->job.id;
    guard(id, [&] {
      while (jobs_.is_unfinished(id)) {
        try {
          const auto film = jobs_.film(id);
          if (film && *film) files_->images.keep(id, **film);
          jobs_.complete(id, run->structure_use(), {.on_disk = true});
        } catch (const std::system_error& error) {  // The disk is full, say. It won't be for ever.
          if (!std::exchange(is_told, true)) spdlog::error("job {}: its image can't be kept yet: {}", id, error.what());
          std::this_thread::sleep_for(kTryToKeepAgain);
        }
      }
    });
    return true;
  };
  files_->writers.submit(1, keep_it);
}

}  // namespace tessera::server
