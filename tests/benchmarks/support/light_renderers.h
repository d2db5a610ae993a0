#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/client.h"
#include "tests/benchmarks/support/daemon_process.h"
#include "tests/benchmarks/support/light_scenes.h"

namespace tessera::bench {

/// An image, and the processor seconds that rendering it took, on all threads: other work on the machine counts little.
/// Reading the scene, building structures of it and encoding don't belong to it.
struct Rendered {
  FloatImage image;
  double seconds = 0;
};

/// Our own daemon, which keeps scenes and structures from job to job: the first one over a scene takes longer.
class Tessera {
 public:
  /// `folder` is where the scenes' meshes are.
  Tessera(const std::filesystem::path& tesserad, std::filesystem::path folder, unsigned threads);

  /// Renders by the path tracer, with `settings` beside those that the scene sets. `stats` and `status` get
  /// the job's where they aren't null. Throws when the job fails.
  Rendered render(const LightScene& scene, nlohmann::json settings, nlohmann::json* stats = nullptr,
                  proto::JobStatus* status = nullptr);

 private:
  /// The hash of a scene that has been posted.
  std::string known(const LightScene& scene);

  std::filesystem::path folder_;
  std::map<std::string, std::string> hashes_;  ///< By the scene's name.
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
