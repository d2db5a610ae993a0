#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/client.h"
#include "tests/benchmarks/support/daemon_process.h"
#include "tests/benchmarks/support/light_scenes.h"

namespace tessera::bench {

/// An image, and how long rendering it took: without parsing, preparing and encoding.
struct Rendered {
  FloatImage image;
  double seconds = 0;
};

/// Our own daemon, which keeps scenes and structures from job to job.
class Tessera {
 public:
  /// `folder` is where the scenes' meshes are.
  Tessera(const std::filesystem::path& tesserad, std::filesystem::path folder, unsigned threads);

  /// Renders by the path tracer, with `settings` beside those that the scene sets. `stats` and `status` get
  /// the job's where they aren't null. Throws when the job fails.
  Rendered render(const LightScene& scene, nlohmann::json settings, nlohmann::json* stats = nullptr,
                  proto::JobStatus* status = nullptr) const;

 private:
  std::filesystem::path folder_;
  DaemonProcess daemon_;
  client::Client client_;
};

struct CyclesRun {
  std::uint32_t samples;
  std::uint32_t seed;
};

/// Blender's Cycles over the same scene, one start of Blender for all runs. Throws when it fails.
std::vector<Rendered> render_with_cycles(const LightScene& scene, const std::filesystem::path& folder, unsigned threads,
                                         const std::vector<CyclesRun>& runs);

}  // namespace tessera::bench
