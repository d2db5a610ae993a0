#pragma once

#include <string>

#include "client/commands/session.h"
#include "client/job_document.h"

namespace CLI {
class App;
}

namespace tessera::client {

/// SCENE and the options that shape its job, as `render` and `submit` take them.
struct SceneArguments {
  std::string scene;
  JobOptions options;
  bool allow_outside = false;

  void add_to(CLI::App& command);
  void add_model_options(CLI::App& command);

  /// Uploads the files that the scene names, then submits the job; tells the scene's warnings on stderr.
  proto::JobStatus submit(const Session& session) const;
};

}  // namespace tessera::client
