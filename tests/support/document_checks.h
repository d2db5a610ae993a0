#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <variant>

#include <nlohmann/json.hpp>

#include "proto/parse.h"
#include "tests/support/no_files.h"

namespace tessera {

/// What a parsed scene may never be, whatever the document says; empty when all is well.
inline std::string fault_of_scene(const Scene& scene) {
  for (const Object& object : scene.objects) {
    if (object.shape >= scene.shapes.size()) return "an object's shape is out of range";
    if (object.material >= scene.materials.size()) return "an object's material is out of range";
    const Aabb box = world_bounds(scene, object);
    if (!box.empty() && (!is_finite(box.lo) || !is_finite(box.hi))) return "an object's bounds aren't finite";
  }
  for (const Shape& shape : scene.shapes) {
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    if (mesh == nullptr) continue;
    if (!mesh->normals.empty() && mesh->normals.size() != mesh->positions.size()) return "a normal too many or few";
    for (const TriangleIndices& t : mesh->triangles) {
      for (const std::uint32_t corner : t) {
        if (corner >= mesh->positions.size()) return "an index is out of range";
      }
    }
  }
  if (std::ranges::count_if(scene.lights, [](const Light& l) { return std::holds_alternative<EnvironmentLight>(l); }) >
      1)
    return "two environments";
  for (const Material& m : scene.materials) {
    if (!is_finite(m.emission) || !(m.alpha >= 0 && m.alpha <= 1)) return "a bad emission or alpha";
    const auto surface = whitted_surface(m.surface);
    if (!surface) continue;
    if (!is_finite(surface->diffuse) || !is_finite(surface->transmit) || !(surface->ior > 0) ||
        !(surface->shininess >= 0)) {
      return "a bad material";
    }
  }
  return is_finite(scene.background) ? "" : "the background isn't finite";
}

/// What a refusal may never be; empty when all is well.
inline std::string fault_of_problem(const proto::Problem& problem) {
  const auto code = problem.code;
  if (code != proto::ProblemCode::malformed_json && code != proto::ProblemCode::invalid_document) {
    return "an unexpected code: " + std::string(proto::entry(code).name);
  }
  if (code == proto::ProblemCode::invalid_document && problem.errors.empty()) return "no error is named";
  if (problem.errors.size() > proto::kMaxFieldErrors) return "too many errors";
  std::string text;
  try {
    text = to_json(problem).dump();
  } catch (const nlohmann::json::exception&) {
    return "the refusal isn't UTF-8";
  }
  return text.size() < 50'000 ? "" : "the refusal is too long";
}

/// Parses a scene document that names no files.
inline std::string fault_of_scene_document(std::string_view bytes) {
  const auto scene = proto::parse_scene(bytes, proto::NoFiles(), proto::Limits());
  return scene ? fault_of_scene(*scene->scene) : fault_of_problem(scene.problem());
}

/// Parses a job document that names no files.
inline std::string fault_of_job_document(std::string_view bytes) {
  const auto job = proto::parse_job(bytes, proto::NoFiles(), proto::Limits());
  if (!job) return fault_of_problem(job.problem());
  const Settings& s = job->settings;
  if (s.width == 0 || s.height == 0 || s.samples == 0 || s.max_depth == 0U) return "an empty job";
  if (std::uint64_t{s.width} * s.height > proto::Limits().max_pixels) return "an image that is too large";
  const auto* scene = std::get_if<proto::ParsedScene>(&job->scene);
  return scene != nullptr ? fault_of_scene(*scene->scene) : "";
}

}  // namespace tessera
