#include <memory>

#include <CLI/CLI.hpp>

#include "client/commands/commands.h"
#include "client/commands/image_arguments.h"

namespace tessera::client {
namespace {

struct Fetch {
  std::string id;
  ImageArguments image;
};

}  // namespace

void add_fetch(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("fetch", "Write a job's image to a file");
  const auto fetch = std::make_shared<Fetch>();
  add_job_argument(*command, fetch->id);
  fetch->image.add_to(*command);
  command->get_option("--output")->required();
  command->add_option("--aov", fetch->image.image.aov,
                      "A recorded plane in place of the colour, or all for one EXR of everything");
  command->add_flag("--partial", fetch->image.image.partial, "What is there so far, if the job still renders");
  command->callback([fetch, &session] {
    fetch->image.check();
    const Client client = session.client();
    fetch->image.save(client, client.find_job(fetch->id));
  });
}

}  // namespace tessera::client
