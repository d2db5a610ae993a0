#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/follow.h"
#include "client/commands/image_arguments.h"
#include "client/commands/scene_arguments.h"
#include "client/failure.h"
#include "client/progress_bar.h"

namespace tessera::client {
namespace {

struct Render {
  SceneArguments scene;
  ImageArguments image{.output = "out.png"};
  bool keep = false;

  void run(Session& session) {
    ImageArguments output = image;
    output.check();
    scene.options.shows_environment = image.image.background == "environment";
    if (scene.options.shows_environment && scene.options.transparent)
      throw CLI::ValidationError("--background", "environment hides what --transparent shows; leave one out");
    const std::string format = model_format(scene.scene);
    if (output.is_for_display() && !format.empty()) show_as_picture(output.image, format == "nff");
    if (output.image.format == "exr" && !scene.options.aovs.empty()) output.image.aov = "all";
    const std::string id = scene.submit(session).id;
    if (!session.json) session.tell("job " + id);

    const proto::JobStatus ended = follow(session, id);
    bool is_kept = keep;
    if (ended.state == proto::JobState::completed) {
      save(session, output, id);
      is_kept |= tell_what_is_left(session, output, id);
    }
    if (!is_kept) is_kept = !remove(session, id);
    if (ended.state == proto::JobState::completed) report(session, output, ended, is_kept);
  }

  /// As POST /v1/render does; a scene has a background of its own.
  void show_as_picture(ImageRequest& shown, bool is_a_scene) const {
    if (shown.tone_map.empty()) shown.tone_map = proto::kPictureToneMap;
    const bool is_clear = scene.options.transparent && shown.format == "png";
    if (shown.background.empty() && (!is_a_scene || scene.options.transparent))
      shown.background = is_clear ? "transparent" : proto::kPictureBackground;
  }

  static void save(const Session& session, const ImageArguments& output, const std::string& id) {
    const std::string is_there = "job " + id + " is kept; 'tessera fetch " + id + " -o FILE' writes its image";
    session.on_interrupt(is_there, id);
    try {
      output.save(session.client(), id);
    } catch (const Failure&) {
      session.note(is_there);
      throw;
    }
    session.on_interrupt("");
  }

  /// Says what the job holds beside the image; whether there is such.
  bool tell_what_is_left(const Session& session, const ImageArguments& output, const std::string& id) const {
    const bool has_planes = output.image.aov.empty() && !scene.options.aovs.empty();
    const bool has_counts = scene.options.count_tests;
    if (has_planes)
      session.note(output.output + " holds the colour; 'tessera fetch " + id + " --aov NAME -o FILE' writes a plane");
    if (has_counts) session.note("'tessera stats " + id + "' tells the tests");
    if ((has_planes || has_counts) && !keep)
      session.note("job " + id + " is kept for that; 'tessera delete " + id + "' removes it");
    return has_planes || has_counts;
  }

  /// Whether the job is gone.
  static bool remove(const Session& session, const std::string& id) try {
    session.client().remove(id);
    return true;
  } catch (const Failure& failure) {
    session.note("job " + id + " stays on the server: " + failure.what());
    return false;
  }

  static void report(Session& session, const ImageArguments& output, const proto::JobStatus& job, bool is_kept) {
    if (session.json) {
      nlohmann::json answer = proto::to_json(job);
      answer["image"] = output.output;
      answer["kept"] = is_kept;
      return output.is_stdout() ? session.tell_json(answer) : session.print_json(answer);
    }
    const std::string line = output.output + ": " + std::to_string(job.width) + 'x' + std::to_string(job.height) +
                             " in " + format_duration(job.elapsed) + format_quality(job);
    output.is_stdout() ? session.tell(line) : session.print(line);
  }
};

}  // namespace

void add_render(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("render", "Submit a scene, watch its job, fetch the image");
  const auto render = std::make_shared<Render>();
  render->scene.add_to(*command);
  render->image.add_to(*command);
  command->add_flag("--keep", render->keep, "Leave the job on the server, for fetch, plan and stats");
  command->callback([render, &session] { render->run(session); });
}

}  // namespace tessera::client
