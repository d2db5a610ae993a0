#include <cstdint>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "core/geometry/shape.h"
#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/jobs/job_submission.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"

namespace tessera::server {
namespace {

nlohmann::json describe(const proto::ParsedScene& parsed) {
  const Scene& scene = *parsed.scene;
  std::uint64_t primitives = 0;
  for (const Object& object : scene.objects) primitives += primitive_count(scene.shapes[object.shape]);
  nlohmann::json warnings = nlohmann::json::array();
  for (const SceneWarning& warning : scene.warnings)
    warnings.push_back({{"pointer", warning.pointer}, {"detail", warning.detail}});
  std::set<const TextureImage*> told;
  for (const Texture& texture : scene.textures) {
    const std::string problem = texture.image->problem();
    if (problem.empty() || !told.insert(texture.image.get()).second) continue;
    warnings.push_back({{"pointer", texture.name}, {"detail", "An image turned out to be broken: " + problem}});
  }
  return {{"scene", parsed.hash},
          {"objects", scene.objects.size()},
          {"primitives", primitives},
          {"warnings", std::move(warnings)}};
}

}  // namespace

Response post_scene(Services& services, Request& request) {
  if (const auto refused = refuse_bytes(services, request.who, "", request.body.size()))
    return problem_response(*refused);
  const OwnFiles files(services, request.who);
  const auto put = services.scenes.put(request.body, files, request.abandoned);
  if (!put) return problem_response(put.problem());
  services.owners.add(request.who.owner, put->scene.hash, request.body.size());
  Response response = json_response(put->known ? 200 : 201, describe(put->scene));
  response.headers.emplace_back("Location", "/v1/scenes/" + put->scene.hash);
  return response;
}

Response delete_scene(Services& services, Request& request) {
  const auto remove = [&](const IsOthers& is_others) { return services.scenes.remove(request.parameter, is_others); };
  switch (delete_own(services, request.who, request.parameter, remove)) {
    case Shelf::Removal::removed:
      return {204, {}, ""};
    case Shelf::Removal::held:
    case Shelf::Removal::needed:
      return problem_response(
          {proto::ProblemCode::in_use, "A job that hasn't ended, or a request, needs this scene.", {}});
    case Shelf::Removal::expired:
      return problem_response({proto::ProblemCode::gone, "The scene has expired.", {}});
    case Shelf::Removal::missing:
      break;
  }
  return problem_response({proto::ProblemCode::not_found, "There is no such scene.", {}});
}

Response describe_scene(Services& services, Request& request) {
  if (!may_use_scene(services, request.who, request.parameter))
    return problem_response(no_such_scene(request.parameter));
  const auto scene = services.scenes.find(request.parameter, request.abandoned);
  return scene ? json_response(200, describe(*scene)) : problem_response(scene.problem());
}

}  // namespace tessera::server
