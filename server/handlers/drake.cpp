#include <algorithm>
#include <bit>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "proto/parse.h"
#include "server/handlers/drake_form.h"
#include "server/handlers/drake_view.h"
#include "server/handlers/handlers.h"
#include "server/handlers/image_choice.h"
#include "server/handlers/picture.h"
#include "server/http/lane.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/jobs/known_jobs.h"
#include "server/store/blob_store.h"
#include "server/store/scene_store.h"

/// POST /render: the glTF Render Client-Server API of Drake (`DrakeForm`).
namespace tessera::server {
using proto::JobState;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

/// The scene that a form brings, put on the disk when it has to be read.
class FormScene : public proto::FileSource {
 public:
  FormScene(const BlobStore& blobs, std::string_view content, const proto::ContentHash& hash)
      : blobs_(blobs), content_(content), hash_(hash) {}

  Result<proto::SourceFile> blob(const proto::ContentHash& hash, const std::stop_token& stop) const override {
    if (hash != hash_) return blobs_.blob(hash, stop);
    if (!file_) {
      file_ = blobs_.receive();
      file_->write(std::as_bytes(std::span(content_)));
    }
    return proto::SourceFile{file_->path(), hash};
  }
  Result<proto::SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override {
    return blobs_.asset(relative_path, stop);
  }
  const proto::AssetReader& reader() const override { return blobs_.reader(); }

 private:
  const BlobStore& blobs_;
  const std::string_view content_;
  const proto::ContentHash& hash_;
  mutable std::unique_ptr<ReceivedFile> file_;
};

/// Where the file has no lights: a lamp of 100 W, five metres above the origin, in front of a dark grey. So it is lit
/// by the server that Drake's users have (drake-blender), which takes Blender's empty scene for that.
std::string scene_document(const proto::ContentHash& hash) {
  constexpr double kIntensity = 7.957747;  // 100 / 4π
  constexpr double kGrey = 0.050876;
  const nlohmann::json lights{
      {{"type", "point"},
       {"position", {0, 0, 5}},
       {"intensity", {kIntensity, kIntensity, kIntensity}},
       {"only_without_lights", true}},
      {{"type", "environment"}, {"radiance", {kGrey, kGrey, kGrey}}, {"only_without_lights", true}}};
  return nlohmann::json{{"objects", {{{"type", "file"}, {"blob", hash}, {"format", "gltf"}}}}, {"lights", lights}}
      .dump();
}

Settings settings_of(const DrakeForm& form) {
  Settings settings;
  settings.width = form.width;
  settings.height = form.height;
  settings.samples = form.samples;
  if (form.image_type == DrakeImage::color) return settings;
  // What the middle of each pixel sees first, and nothing beyond it.
  settings.jitter = false;
  settings.integrator = IntegratorKind::none;
  settings.aovs = {form.image_type == DrakeImage::depth ? Aov::depth : Aov::base_color};
  return settings;
}

ImageChoice choice_of(const DrakeForm& form) {
  Encoding encoding;
  encoding.format = form.format;
  Plane plane = kColorPlane;
  if (form.image_type == DrakeImage::color) encoding.has_alpha = true;
  if (form.image_type == DrakeImage::label) plane = Plane{Aov::base_color};
  if (form.image_type == DrakeImage::depth) {
    plane = Plane{Aov::depth};
    encoding.sensor = form.sensor;
  }
  const auto format = std::ranges::find(format_table(), form.format, &FormatEntry::format);
  return {plane, *format, encoding, false};
}

/// All that the pixels of an image depend on.
std::string key_of(const DrakeForm& form) {
  std::string key = "drake " + form.scene_sha256;
  const auto add = [&](std::uint32_t bits) { key += ' ' + std::to_string(bits); };
  add(static_cast<std::uint32_t>(form.image_type));
  for (const std::uint32_t number : {form.width, form.height, form.samples}) add(number);
  const auto& [fx, fy, cx, cy] = form.intrinsics;
  for (const float number : {form.clipping.near, form.clipping.far, fx, fy, cx, cy})
    add(std::bit_cast<std::uint32_t>(number));
  return key;
}

/// In terms of the form, and each fault once.
Problem scene_problem(Problem problem, const proto::ContentHash& scene) {
  if (problem.errors.empty()) problem.detail = "scene: " + problem.detail;
  std::vector<proto::FieldError> told;
  for (proto::FieldError& error : problem.errors) {
    const bool is_inside = error.pointer.starts_with(scene) && error.pointer.size() > scene.size();
    error.pointer = is_inside ? "scene: " + error.pointer.substr(scene.size()) : "scene";
    const auto is_this = [&](const proto::FieldError& other) {
      return other.pointer == error.pointer && other.detail == error.detail;
    };
    if (std::ranges::none_of(told, is_this)) told.push_back(std::move(error));
  }
  problem.errors = std::move(told);
  return problem;
}

Problem job_problem(Problem problem) {
  for (proto::FieldError& error : problem.errors) error.pointer = "width, height";
  return problem;
}

Result<PreparedJob> prepare(Services& services, const DrakeForm& form, const Principal& who,
                            const std::stop_token& abandoned) {
  const FormScene files(services.blobs, form.scene, form.scene_sha256);
  const auto found = find_drake_view(form.scene);
  const std::string key = "drake " + (found ? found->rest : form.scene_sha256);
  auto scene = services.scenes.parse_once(key, scene_document(form.scene_sha256), files, abandoned);
  if (!scene) return scene_problem(scene.problem(), form.scene_sha256);
  if (!scene->scene->camera)
    return Problem{ProblemCode::malformed_request,
                   "",
                   {{"scene", "The file has no camera in its scene; its node says where the image is taken from."}}};
  const View view =
      found ? found->view : std::visit([](const auto& camera) { return camera.view; }, *scene->scene->camera);
  proto::JobRequest job;
  job.scene = *std::move(scene);
  job.camera = PerspectiveCamera{.view = view, .intrinsics = form.intrinsics, .clipping = form.clipping};
  job.settings = settings_of(form);
  job.has_image = true;
  job.name = "drake";
  auto prepared = prepare_job(services, std::move(job), "", who, abandoned);
  if (!prepared) return job_problem(prepared.problem());
  return prepared;
}

struct Wanted {
  std::string job, key;
  ImageChoice choice;
  unsigned attempt;
};

Response render(Services& services, Request& request, unsigned attempt);

/// Once more, when an image has given way to those of others before it could be sent.
Response render_again(Services& services, Request& request, const Wanted& wanted) {
  if (wanted.attempt < kMostAttempts) return render(services, request, wanted.attempt + 1);
  return text_response(gave_way());
}

/// The image, when the job has ended.
Response answer(Services& services, Request& request, const Wanted& wanted) {
  const auto job = services.jobs.find(wanted.job);
  if (!job) return render_again(services, request, wanted);  // It has been forgotten meanwhile,
  if (job->state == JobState::failed)
    return text_response({ProblemCode::internal_error, "The job " + job->id + " failed: " + job->error + ".", {}});
  if (job->state != JobState::completed)
    return text_response({ProblemCode::shutting_down, "The job " + job->id + " was canceled.", {}});
  if (job->image == proto::ImageState::gone && !is_encoded(services, job->id, wanted.choice))
    return render_again(services, request, wanted);  // or its image has given way.
  Response response = picture_response(services, request, *job, wanted.choice, wanted.key);
  if (response.status >= 400) return render_again(services, request, wanted);
  services.jobs.let_image_go(job->id);  // A robot looks once, from each place.
  response.headers.emplace_back("Location", "/v1/jobs/" + job->id);
  return response;
}

Response render(Services& services, Request& request, unsigned attempt) {
  FileBudget::spend(request.file->size());
  const auto form = read_drake_form(request, request.file->content());
  if (!form) return text_response(form.problem());
  if (const auto hash = proto::content_hash(form->scene); hash != form->scene_sha256)
    return text_response({ProblemCode::hash_mismatch,
                          "",
                          {{"scene_sha256", "\"scene\" came with another hash, " + hash + "; send it again."}}});
  const Wanted known{"", key_of(*form), choice_of(*form), attempt};
  const auto job = find_or_start(
      services, known.key, true,
      [&](const std::stop_token& unwanted) { return prepare(services, *form, request.who, unwanted); }, request.who,
      [&](const JobView& view) {
        return view.image != proto::ImageState::gone || is_encoded(services, view.id, known.choice);
      },
      request.abandoned);
  if (!job) return text_response(job.problem());
  const Wanted wanted{job->id, known.key, known.choice, attempt};
  const auto view = services.jobs.find(job->id);
  if (!view || proto::has_ended(view->state)) return answer(services, request, wanted);
  const auto go_on = [wanted](Services& its_services, Request& its_request) {
    return answer(its_services, its_request, wanted);
  };
  Response response;
  response.later = std::make_shared<const Later>(Later{job->id, std::nullopt, job->hold, go_on});
  return response;
}

}  // namespace

Response post_drake_render(Services& services, Request& request) { return render(services, request, 1); }

}  // namespace tessera::server
