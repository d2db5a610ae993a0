#include "proto/import/flat_import.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "proto/wire/printable.h"

namespace tessera::proto {

template <>
inline constexpr ProblemCode kLastOf<ProblemCode> = ProblemCode::internal_error;

}  // namespace tessera::proto

namespace tessera {

// Beside the types, where `FlatWriter` and `FlatReader` find them.

template <typename A, typename T>
using Flat = typename A::template Of<T>;

template <typename A>
void flatten(A& a, Flat<A, Vec2>& v) {
  a(v.x, v.y);
}
template <typename A>
void flatten(A& a, Flat<A, Vec3>& v) {
  a(v.x, v.y, v.z);
}
template <typename A>
void flatten(A& a, Flat<A, Rgb>& c) {
  a(c.r, c.g, c.b);
}

void flatten(proto::FlatWriter& a, const UnitVec3& v) { a(v.vec()); }
void flatten(proto::FlatReader& a, UnitVec3& v) {
  Vec3 read;
  a(read);
  a.expect(std::abs(dot(to_double(read), to_double(read)) - 1) < 1e-3);
  static_assert(sizeof(UnitVec3) == sizeof(Vec3));
  v = std::bit_cast<UnitVec3>(read);  // Normalising it again might change its last bit.
}

template <typename A>
void flatten(A& a, Flat<A, Sphere>& s) {
  a(s.center, s.radius);
}
template <typename A>
void flatten(A& a, Flat<A, Cylinder>& c) {
  a(c.base, c.apex, c.radius);
}
template <typename A>
void flatten(A& a, Flat<A, Cone>& c) {
  a(c.base, c.base_radius, c.apex, c.apex_radius);
}
template <typename A>
void flatten(A& a, Flat<A, Disk>& d) {
  a(d.center, d.normal, d.radius);
}
template <typename A>
void flatten(A& a, Flat<A, Quad>& q) {
  a(q.corners);
}
template <typename A>
void flatten(A& a, Flat<A, MeshAttributes>& m) {
  for (auto& uvs : m.uvs) a.array(uvs);
  a.array(m.tangents);
  a.array(m.colors);
}

void flatten(proto::FlatWriter& a, const TriangleMesh& mesh) {
  a.array(mesh.positions);
  a.array(mesh.triangles);
  a.array(mesh.normals);
  a(mesh.attributes != nullptr);
  if (mesh.attributes) a(*mesh.attributes);
}

namespace {

template <typename T>
bool are_finite(const std::vector<T>& values) {
  static_assert(sizeof(T) % sizeof(float) == 0 && std::is_trivially_copyable_v<T>);
  const std::span numbers(reinterpret_cast<const float*>(values.data()), values.size() * (sizeof(T) / sizeof(float)));
  float nothing = 0;  // 0, or NaN once a number isn't finite: so that many are looked at together.
  for (const float number : numbers) nothing += number * 0;
  return nothing == 0;
}

template <typename T>
bool fits(const std::vector<T>& values, std::size_t positions) {
  return (values.empty() || values.size() == positions) && are_finite(values);
}

/// What a mesh's contract says.
bool is_valid(const TriangleMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  std::uint32_t last = 0;
  for (const TriangleIndices& t : mesh.triangles) last = std::max({last, t[0], t[1], t[2]});
  if (!mesh.triangles.empty() && last >= count) return false;
  const auto usable = [](Vec3 p) { return max_component(abs(p)) <= kLargestCoordinate && is_finite(p); };
  const auto is_good = [&](const TriangleIndices& t) {
    return t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && usable(mesh.positions[t[0]]) &&
           usable(mesh.positions[t[1]]) && usable(mesh.positions[t[2]]);
  };
  if (!std::ranges::all_of(mesh.triangles, is_good)) return false;
  if (!mesh.normals.empty() && mesh.normals.size() != count) return false;
  if (!mesh.attributes) return true;
  const MeshAttributes& has = *mesh.attributes;
  return fits(has.uvs[0], count) && fits(has.uvs[1], count) && fits(has.tangents, count) && fits(has.colors, count);
}

}  // namespace

void flatten(proto::FlatReader& a, TriangleMesh& mesh) {
  a.array(mesh.positions);
  a.array(mesh.triangles);
  a.array(mesh.normals);
  bool has_attributes = false;
  a(has_attributes);
  if (has_attributes) {
    auto attributes = std::make_shared<MeshAttributes>();
    a(*attributes);
    mesh.attributes = std::move(attributes);
  }
  a.expect(is_valid(mesh));
}

template <typename A>
void flatten(A& a, Flat<A, WhittedSurface>& s) {
  a(s.diffuse, s.specular, s.shininess, s.reflect, s.transmit, s.ior, s.fresnel);
}
template <typename A>
void flatten(A& a, Flat<A, Diffuse>& s) {
  a(s.color);
}
template <typename A>
void flatten(A& a, Flat<A, Conductor>& s) {
  a(s.eta, s.k, s.roughness);
}
template <typename A>
void flatten(A& a, Flat<A, Dielectric>& s) {
  a(s.ior, s.roughness, s.color);
}
template <typename A>
void flatten(A& a, Flat<A, MetallicRoughness>& s) {
  a(s.base_color, s.metallic, s.roughness);
}
template <typename A>
void flatten(A& a, Flat<A, Layered>& s) {
  a(s.base_color, s.metallic, s.roughness, s.ior, s.specular, s.specular_color, s.transmission, s.thin, s.clearcoat,
    s.clearcoat_roughness, s.sheen_color, s.sheen_roughness);
}
template <typename A>
void flatten(A& a, Flat<A, Unlit>& s) {
  a(s.color);
}
template <typename A>
void flatten(A& a, Flat<A, TextureUse>& use) {
  a(use.slot, use.texture, use.channel, use.scale);
}
template <typename A>
void flatten(A& a, Flat<A, Material>& m) {
  a(m.surface, m.emission, m.emits_both_sides, m.alpha, m.alpha_cutoff, m.has_vertex_colors, m.has_vertex_alpha,
    m.textures, m.absorption);
}

template <typename A>
void flatten(A& a, Flat<A, PointLight>& l) {
  a(l.position, l.intensity, l.falls_off);
}
template <typename A>
void flatten(A& a, Flat<A, DirectionalLight>& l) {
  a(l.direction, l.irradiance);
}
template <typename A>
void flatten(A& a, Flat<A, AmbientLight>& l) {
  a(l.radiance);
}
template <typename A>
void flatten(A& a, Flat<A, SpotLight>& l) {
  a(l.position, l.direction, l.intensity, l.inner_angle, l.outer_angle);
}
template <typename A>
void flatten(A& a, Flat<A, SunLight>& l) {
  a(l.direction, l.irradiance, l.angle);
}
template <typename A>
void flatten(A& a, Flat<A, EnvironmentLight>& l) {
  if (l.map) throw std::logic_error("a file has no environment of its own");
  a(l.radiance, l.to_world);
}

template <typename A>
void flatten(A& a, Flat<A, View>& v) {
  a(v.from, v.at, v.up, v.is_placed);
}
template <typename A>
void flatten(A& a, Flat<A, Intrinsics>& i) {
  a(i.fx, i.fy, i.cx, i.cy);
}
template <typename A>
void flatten(A& a, Flat<A, Lens>& l) {
  a(l.radius, l.focus_distance);
}
void flatten(proto::FlatWriter& a, const Clipping& c) { a(c.near, c.far); }
void flatten(proto::FlatReader& a, Clipping& c) {
  a(c.near);
  a.any_number(c.far);
}
template <typename A>
void flatten(A& a, Flat<A, PerspectiveCamera>& c) {
  a(c.view, c.vertical_fov, c.intrinsics, c.lens, c.clipping);
}
template <typename A>
void flatten(A& a, Flat<A, OrthographicCamera>& c) {
  a(c.view, c.height, c.clipping);
}

template <typename A>
void flatten(A& a, Flat<A, Transform::Kept>& t) {
  a(t.world_to_local, t.turns_little);
}
template <typename A>
void flatten(A& a, Flat<A, ImageSize>& s) {
  a(s.width, s.height);
}
template <typename A>
void flatten(A& a, Flat<A, SceneWarning>& w) {
  a(w.pointer, w.detail);
}

}  // namespace tessera

namespace tessera::proto {

template <>
inline constexpr TextureSlot kLastOf<TextureSlot> = TextureSlot::glossiness;
template <>
inline constexpr Wrap kLastOf<Wrap> = Wrap::mirror;

template <typename A>
void flatten(A& a, Flat<A, FieldError>& e) {
  a(e.pointer, e.detail);
}
template <typename A>
void flatten(A& a, Flat<A, Problem>& p) {
  a(p.code, p.detail, p.errors);
}
template <typename A>
void flatten(A& a, Flat<A, NamedCamera>& c) {
  a(c.name, c.camera);
}
template <typename A>
void flatten(A& a, Flat<A, ImportedPart>& p) {
  a(p.shape, p.material);
}
void flatten(FlatWriter& a, const ImportedPlacement& p) {
  a(p.part, p.placement ? std::optional(p.placement->kept()) : std::nullopt, p.material);
}
void flatten(FlatReader& a, ImportedPlacement& p) {
  std::optional<Transform::Kept> placement;
  a(p.part, placement, p.material);
  if (placement) p.placement = Transform::from_kept(*placement);
}

namespace {

/// All of a texture but its image, which is told by its number.
template <typename A>
void flatten_texture(A& a, Flat<A, Texture>& t, Flat<A, std::uint32_t>& image) {
  a(image, t.wrap_u, t.wrap_v, t.is_nearest, t.is_srgb, t.uv_set, t.transform, t.name);
}

void write_textures(const std::vector<Texture>& textures, FlatWriter& out,
                    std::vector<std::span<const std::byte>>& large_images) {
  std::map<const TextureImage*, std::uint32_t> numbers;
  std::vector<const TextureImage*> images;
  for (const Texture& texture : textures)
    if (numbers.try_emplace(texture.image.get(), static_cast<std::uint32_t>(images.size())).second)
      images.push_back(texture.image.get());
  out(std::uint64_t{images.size()});
  for (const TextureImage* image : images) {
    const EncodedImage& file = image->file();
    if (!file.bytes) throw std::logic_error("an image without a file");
    const bool is_large = file.bytes->size() >= kLargeImage;
    out(std::uint64_t{image->bytes()}, file.name, std::uint64_t{file.bytes->size()}, is_large);
    if (is_large) {
      large_images.push_back(*file.bytes);
    } else {
      out.array(*file.bytes);
    }
  }
  out(std::uint64_t{textures.size()});
  for (const Texture& texture : textures) flatten_texture(out, texture, numbers.at(texture.image.get()));
}

std::vector<Texture> read_textures(FlatReader& in, const MakeImage& make_image) {
  std::vector<std::shared_ptr<const TextureImage>> images;
  std::uint64_t count = 0;
  for (in(count); count > 0; --count) {
    FlatImage image;
    bool is_large = false;
    in(image.bytes, image.name, image.file_bytes, is_large);
    if (!is_large) image.file = in.array_bytes();
    in.expect(is_large ? image.file_bytes >= kLargeImage : image.file_bytes == image.file.size());
    images.push_back(make_image(image));
  }
  std::vector<Texture> textures;
  for (in(count); count > 0; --count) {
    std::uint32_t image = 0;
    Texture& texture = textures.emplace_back();
    flatten_texture(in, texture, image);
    in.expect(image < images.size() && texture.uv_set <= 1);
    texture.image = images[image];
  }
  return textures;
}

template <typename A>
void flatten_rest(A& a, Flat<A, Imported>& i) {
  a(i.parts, i.placements, i.materials, i.lights, i.background, i.cameras, i.image, i.warnings);
}

/// What a message says comes from a process that may say anything.
template <typename Message>
void make_printable(std::vector<Message>& messages) {
  for (Message& message : messages) {
    message.pointer = printable(message.pointer);
    message.detail = printable(message.detail);
  }
}

void expect_valid(const Imported& i) {
  const auto has_material = [&](const auto& placed) {
    return !placed.material || *placed.material < i.materials.size();
  };
  FlatReader::expect(std::ranges::all_of(i.parts, has_material) && std::ranges::all_of(i.placements, has_material));
  FlatReader::expect(std::ranges::all_of(i.placements, [&](const auto& p) { return p.part < i.parts.size(); }));
  for (const Material& material : i.materials)
    FlatReader::expect(std::ranges::all_of(
        material.textures, [&](const TextureUse& use) { return use.texture < i.textures.size() && use.channel <= 3; }));
}

/// Whether there is a result; what is wrong where there isn't.
template <typename T>
bool write_problem(const Result<T>& result, FlatWriter& out) {
  out(static_cast<bool>(result));
  if (!result) out(result.problem());
  return static_cast<bool>(result);
}

std::optional<Problem> read_problem(FlatReader& in) {
  bool is_good = false;
  in(is_good);
  if (is_good) return std::nullopt;
  Problem problem;
  in(problem);
  FlatReader::expect(problem.code == ProblemCode::invalid_document || problem.code == ProblemCode::internal_error ||
                     problem.code == ProblemCode::out_of_memory_budget);
  FlatReader::expect(problem.errors.size() <= kMaxFieldErrors + 1);
  in.expect_end();
  problem.detail = printable(problem.detail);
  make_printable(problem.errors);
  return problem;
}

}  // namespace

void flatten_import(const Result<Imported>& imported, FlatWriter& out,
                    std::vector<std::span<const std::byte>>& large_images) {
  if (!write_problem(imported, out)) return;
  flatten_rest(out, *imported);
  write_textures(imported->textures, out, large_images);
}

Result<Imported> unflatten_import(std::span<const std::byte> bytes, const MakeImage& make_image) {
  FlatReader in(bytes);
  if (auto problem = read_problem(in)) return *std::move(problem);
  Imported imported;
  flatten_rest(in, imported);
  imported.textures = read_textures(in, make_image);
  in.expect_end();
  expect_valid(imported);
  make_printable(imported.warnings);
  return imported;
}

void flatten_environment(const Result<std::shared_ptr<const EnvironmentMap>>& map, FlatWriter& out) {
  if (!write_problem(map, out)) return;
  out((*map)->width, (*map)->height);
  out.array((*map)->texels);
}

Result<std::shared_ptr<const EnvironmentMap>> unflatten_environment(std::span<const std::byte> bytes) {
  FlatReader in(bytes);
  if (auto problem = read_problem(in)) return *std::move(problem);
  auto map = std::make_shared<EnvironmentMap>();
  in(map->width, map->height);
  in.array(map->texels);
  in.expect_end();
  in.expect(map->width > 0 && map->height > 0 && map->texels.size() == std::uint64_t{map->width} * map->height);
  const auto is_light = [](float v) { return v >= 0 && v <= kLargestLight; };
  in.expect(std::ranges::all_of(map->texels, [&](Rgb c) { return is_light(c.r) && is_light(c.g) && is_light(c.b); }));
  return std::shared_ptr<const EnvironmentMap>(std::move(map));
}

}  // namespace tessera::proto
