#include "tests/benchmarks/support/job_peer_scene.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/benchmarks/support/mesh_files.h"
#include "tests/benchmarks/support/text_file.h"

namespace tessera::bench {
namespace {

constexpr Vec3 kEye{0, 1.6F, 4.2F}, kLight{3, 5, 4};
constexpr float kFieldOfView = 45;   ///< Degrees.
constexpr float kZoom = 1.2071068F;  ///< Tachyon's name for the same: 1 / (2 tan 22.5°).
constexpr float kGroundHalf = 6, kBodyGrey = 0.75F, kGroundGrey = 0.5F;

std::array<Vec3, 4> ground_corners(const JobScene& scene) {
  const float y = scene.ground, s = kGroundHalf;
  return {Vec3{-s, y, s}, Vec3{s, y, s}, Vec3{s, y, -s}, Vec3{-s, y, -s}};
}

nlohmann::json to_json(Vec3 v) { return {v.x, v.y, v.z}; }

struct Spaced {
  Vec3 v;
};
TextFile& operator<<(TextFile& file, Spaced s) { return file << s.v.x << " " << s.v.y << " " << s.v.z; }

struct Bracketed {
  Vec3 v;
};
TextFile& operator<<(TextFile& file, Bracketed b) {
  return file << "<" << b.v.x << "," << b.v.y << "," << b.v.z << ">";
}

}  // namespace

JobScene job_scene(const std::string& name, std::uint32_t triangles) {
  JobScene scene{name, organic(triangles), 0};
  for (const Vec3 p : scene.body.positions) scene.ground = std::min(scene.ground, p.y);
  return scene;
}

std::filesystem::path write_for_tessera(const JobScene& scene, const std::filesystem::path& folder,
                                        const std::string& mesh_format) {
  const std::string mesh = scene.name + '.' + mesh_format;
  if (mesh_format == "obj")
    write_obj(scene.body, ObjCorners::v, folder / mesh);
  else
    write_ply(scene.body, PlyBody::little_endian, folder / mesh);

  nlohmann::json corners = nlohmann::json::array();
  for (const Vec3 corner : ground_corners(scene)) corners.push_back(to_json(corner));
  const auto grey = [](float value) { return nlohmann::json{{"type", "diffuse"}, {"color", {value, value, value}}}; };
  const float intensity = 0.8F * dot(kLight, kLight) * 3.14159F;
  const nlohmann::json document = {
      {"camera",
       {{"type", "perspective"}, {"from", to_json(kEye)}, {"at", {0, 0, 0}}, {"up", {0, 1, 0}}, {"fov", kFieldOfView}}},
      {"lights",
       {{{"type", "point"}, {"position", to_json(kLight)}, {"intensity", {intensity, intensity, intensity}}}}},
      {"materials", {{"body", grey(kBodyGrey)}, {"ground", grey(kGroundGrey)}}},
      {"objects",
       {{{"type", "file"}, {"path", mesh}, {"material", "body"}},
        {{"type", "quad"}, {"corners", corners}, {"material", "ground"}}}}};
  const auto path = folder / (scene.name + '-' + mesh_format + ".json");
  TextFile file(path);
  file << document.dump();
  file.close();
  return path;
}

std::filesystem::path write_for_tachyon(const JobScene& scene, const std::filesystem::path& folder) {
  const auto path = folder / (scene.name + ".dat");
  TextFile file(path);
  // Its space is left-handed: with z turned round it shows what the others do.
  const auto mirrored = [](Vec3 v) { return Spaced{{v.x, v.y, -v.z}}; };
  file << "BEGIN_SCENE\nRESOLUTION 1024 1024\nCAMERA\nZOOM " << kZoom
       << "\nASPECTRATIO 1.0\nANTIALIASING 0\nRAYDEPTH 1\nCENTER " << mirrored(kEye) << "\nVIEWDIR "
       << mirrored(kEye * -1) << "\nUPDIR 0 1 0\nEND_CAMERA\nBACKGROUND 0 0 0\nLIGHT CENTER " << mirrored(kLight)
       << " RAD 0.01 COLOR 1 1 1\n";
  const auto texture = [&](const char* name, float grey) {
    file << "TEXDEF " << name << " AMBIENT 0 DIFFUSE " << 0.8F << " SPECULAR 0 OPACITY 1 COLOR " << grey << " " << grey
         << " " << grey << " TEXFUNC 0\n";
  };
  texture("body", kBodyGrey);
  texture("ground", kGroundGrey);
  const auto triangle = [&](Vec3 a, Vec3 b, Vec3 c, const char* surface) {
    file << "TRI V0 " << mirrored(a) << " V1 " << mirrored(b) << " V2 " << mirrored(c) << " " << surface << "\n";
  };
  const auto ground = ground_corners(scene);
  triangle(ground[0], ground[1], ground[2], "ground");
  triangle(ground[0], ground[2], ground[3], "ground");
  const auto& p = scene.body.positions;
  for (const auto& [a, b, c] : scene.body.triangles) triangle(p[a], p[b], p[c], "body");
  file << "END_SCENE\n";
  file.close();
  return path;
}

std::filesystem::path write_for_povray(const JobScene& scene, const std::filesystem::path& folder) {
  const auto path = folder / (scene.name + ".pov");
  TextFile file(path);
  file << "#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level 1 }\nbackground { rgb 0 }\n"
       << "camera { perspective location " << Bracketed{kEye} << " right -x up y angle " << kFieldOfView
       << " look_at <0,0,0> }\nlight_source { " << Bracketed{kLight} << " rgb 1 }\n";
  const auto texture = [](TextFile& out, float grey) -> TextFile& {
    return out << "texture { pigment { rgb " << grey << " } finish { ambient 0 diffuse " << 0.8F << " } }";
  };
  const auto ground = ground_corners(scene);
  file << "mesh { triangle { " << Bracketed{ground[0]} << "," << Bracketed{ground[1]} << "," << Bracketed{ground[2]}
       << " } triangle { " << Bracketed{ground[0]} << "," << Bracketed{ground[2]} << "," << Bracketed{ground[3]}
       << " } ";
  texture(file, kGroundGrey) << " }\nmesh2 { vertex_vectors { " << scene.body.positions.size();
  for (const Vec3 p : scene.body.positions) file << ",\n" << Bracketed{p};
  file << " }\nface_indices { " << scene.body.triangles.size();
  for (const auto& [a, b, c] : scene.body.triangles) file << ",\n<" << a << "," << b << "," << c << ">";
  file << " }\n";
  texture(file, kBodyGrey) << " }\n";
  file.close();
  return path;
}

}  // namespace tessera::bench
