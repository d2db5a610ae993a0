#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/follow.h"
#include "client/commands/image_arguments.h"
#include "client/commands/scene_arguments.h"
#include "client/progress_bar.h"

namespace tessera::client {
namespace {

struct Render {
  SceneArguments scene;
  ImageArguments image{.output = "out.png"};

  void run(Session& session) {
    image.check();
    if (image.image.format == "exr" && !scene.options.aovs.empty()) image.image.aov = "all";
    const Client client = session.client();
    const proto::JobStatus submitted = scene.submit(client);
    std::cerr << "job " << submitted.id << "\n";
    const proto::JobStatus ended = follow(session, submitted.id);
    if (ended.state != proto::JobState::completed) return;
    image.save(client, ended.id);
    if (image.image.aov.empty() && !scene.options.aovs.empty())
      std::cerr << "note: " << image.output << " holds the colour; 'tessera fetch " << ended.id
                << " --aov NAME -o FILE' writes a plane\n";
    report(session, ended);
  }

  void report(const Session& session, const proto::JobStatus& job) const {
    if (session.json) {
      nlohmann::json answer = proto::to_json(job);
      answer["image"] = image.output;
      std::cout << answer.dump(2) << "\n";
      return;
    }
    std::cout << image.output << ": " << job.width << "x" << job.height << " in " << format_duration(job.elapsed)
              << "\n";
  }
};

}  // namespace

void add_render(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("render", "Submit a scene, watch its job, fetch the image");
  const auto render = std::make_shared<Render>();
  render->scene.add_to(*command);
  render->image.add_to(*command);
  command->callback([render, &session] { render->run(session); });
}

}  // namespace tessera::client
