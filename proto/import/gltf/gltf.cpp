#include "proto/import/gltf/gltf.h"

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "proto/import/gltf/accessors.h"
#include "proto/import/gltf/bake.h"
#include "proto/import/gltf/buffers.h"
#include "proto/import/gltf/extensions.h"
#include "proto/import/gltf/file.h"
#include "proto/import/gltf/glb.h"
#include "proto/import/gltf/materials.h"
#include "proto/import/gltf/meshes.h"
#include "proto/import/gltf/nodes.h"
#include "proto/import/gltf/skins.h"
#include "proto/import/gltf/textures.h"
#include "proto/import/gltf/triangles.h"
#include "proto/import/gltf/views_and_lights.h"
#include "proto/import/mesh_repair.h"

namespace tessera::proto {
namespace {

/// The position of the variant of that name (KHR_materials_variants); nothing, with an error, where there is none.
std::optional<std::uint32_t> find_variant(GltfFile& file, const std::optional<std::string>& name) {
  if (!name) return std::nullopt;
  std::string known;
  if (const auto extension = file.root().extension("KHR_materials_variants")) {
    std::uint32_t at = 0;
    for (const JsonCursor& element : extension->array("variants")) {
      const auto field = GltfObject(element).find("name");
      if (field && field->kind() == JsonKind::string) {
        if (field->string() == *name) return at;
        known += (known.empty() ? "" : ", ") + in_quotes(field->string());
      }
      ++at;
    }
  }
  file.refuse_option("variant", "There is no variant " + in_quotes(*name) + "; the file has " +
                                    (known.empty() ? "none" : known) + ".");
  return std::nullopt;
}

/// Numbers that no vertex can have.
void mend_attributes(GltfTriangles& triangles, GltfFile& file, const JsonCursor& where) {
  MeshAttributes& attributes = triangles.attributes;
  std::uint64_t uvs = 0, tangents = 0, colors = 0;
  for (auto& set : attributes.uvs) {
    for (Vec2& uv : set) {
      if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
      uv = {};
      ++uvs;
    }
  }
  for (Tangent& t : attributes.tangents) {
    if (is_finite(t.direction) && (t.sign == 1 || t.sign == -1)) continue;
    t = {};
    ++tangents;
  }
  for (auto& color : attributes.colors) {
    for (float& channel : color) {
      if (channel >= 0 && channel <= 1) continue;
      channel = channel > 1 ? 1 : 0;
      ++colors;
    }
  }
  file.note(where, "A texture coordinate that isn't finite counts as 0", uvs);
  file.note(where, "A tangent that isn't finite or has no side is ignored", tangents);
  file.note(where, "A channel of a vertex colour below 0 or above 1 counts as that", colors);
}

/// Of a skin, which all primitives of its mesh share.
using Joints = std::shared_ptr<const std::vector<Rows>>;

class Assembly {
 public:
  Assembly(GltfFile& file, GltfBuffers& buffers, Accessors& accessors, GltfMaterials& materials)
      : file_(file), buffers_(buffers), accessors_(accessors), materials_(materials) {}

  /// `joints` are those of a skin, in place of `to_world`; null without.
  void show(const GltfMesh& mesh, const Rows& to_world, const Joints& joints = nullptr) {
    for (const Primitive& primitive : mesh.primitives) {
      file_.steps().take();
      if (!file_.take(sizeof(ImportedPlacement), primitive.where)) return;
      if (!primitive.is_surface()) {
        file_.note(primitive.where,
                   primitive.position ? "Points and lines aren't shown" : "A primitive without positions isn't shown");
        continue;
      }
      if (!has_data(primitive)) {
        file_.note(primitive.where, "A primitive isn't shown: its buffer comes without data");
        continue;
      }
      if (joints && primitive.joints && primitive.weights) {
        parts_.push_back(
            {&primitive, joints, {{to_world, materials_.use(primitive.material, primitive.color.has_value())}}});
        continue;
      }
      const auto [known, is_new] = known_.try_emplace(key(primitive), parts_.size());
      if (is_new) parts_.push_back({&primitive, nullptr, {}});
      parts_[known->second].places.push_back(
          {to_world, materials_.use(primitive.material, primitive.color.has_value())});
    }
  }

  void finish(Imported& out) {
    bool are_baked = true;
    for (const Part& part : parts_) are_baked &= part.places.size() == 1;
    for (const Part& part : parts_) {
      make(part, are_baked, out);
      if (!file_.errors().empty()) return;
    }
  }

 private:
  struct Place {
    Rows to_world;
    std::uint32_t material;
  };
  struct Part {
    const Primitive* primitive;
    Joints joints;
    std::vector<Place> places;
  };

  /// Primitives with the same key have the same triangles.
  using Key = std::tuple<Topology, std::array<std::optional<std::uint32_t>, 8>,
                         std::map<std::string, std::uint32_t, std::less<>>>;
  static Key key(const Primitive& p) {
    std::optional<std::uint32_t> draco;
    if (p.draco) draco = p.draco->view;
    return {p.topology,
            {p.position, p.normal, p.tangent, p.color, p.uvs[0], p.uvs[1], p.indices, draco},
            p.draco ? p.draco->ids : std::map<std::string, std::uint32_t, std::less<>>()};
  }

  bool has_data(const Primitive& p) const {
    for (const auto& accessor : {p.position, p.normal, p.tangent, p.color, p.uvs[0], p.uvs[1], p.indices})
      if (accessor && !accessors_.has_data(*accessor)) return false;
    return !p.draco || buffers_.has_bytes(p.draco->view);
  }

  void make(const Part& part, bool are_baked, Imported& out) {
    const JsonCursor& where = part.primitive->where;
    auto triangles = read_triangles(*part.primitive, accessors_, buffers_, file_);
    if (!triangles) return;
    const bool is_baked = part.places.size() == 1;
    if (part.joints) {
      const std::size_t vertices = triangles->mesh.positions.size();
      if (triangles->joints.size() != vertices || triangles->weights.size() != vertices) {
        where.error("The primitive is compressed without the joints and weights of its skin.");
        return;
      }
      if (!bake_skin(*triangles, *part.joints, file_.steps())) {
        where.error("A vertex names a joint that its skin doesn't have.");
        return;
      }
    } else if (is_baked) {
      if (!Transform::from_rows(part.places.front().to_world)) return note_flat(where);
      bake(*triangles, part.places.front().to_world, file_.steps());
    }
    mend_attributes(*triangles, file_, where);
    repair_mesh(triangles->mesh, file_.notes(), where.index());
    if (triangles->mesh.triangles.empty()) return;
    const MeshAttributes& attributes = triangles->attributes;
    if (!attributes.uvs[0].empty() || !attributes.uvs[1].empty() || !attributes.colors.empty() ||
        !attributes.tangents.empty())
      triangles->mesh.attributes = std::make_shared<const MeshAttributes>(std::move(triangles->attributes));

    const auto index = static_cast<std::uint32_t>(out.parts.size());
    const std::uint32_t material = part.places.front().material;
    out.parts.push_back({std::move(triangles->mesh), material});
    if (are_baked) return;
    if (is_baked) out.placements.push_back({index, std::nullopt, std::nullopt});
    for (const Place& place : part.places) {
      if (is_baked) break;
      ImportedPlacement placement{index, std::nullopt, std::nullopt};
      if (place.to_world != kIdentity) {
        placement.placement = Transform::from_rows(place.to_world);
        if (!placement.placement) {
          note_flat(where);
          continue;
        }
      }
      if (place.material != material) placement.material = place.material;
      out.placements.push_back(placement);
    }
  }

  void note_flat(const JsonCursor& where) {
    file_.note(where, "A mesh isn't shown where its node's matrix makes it flat, or isn't finite");
  }

  GltfFile& file_;
  GltfBuffers& buffers_;
  Accessors& accessors_;
  GltfMaterials& materials_;
  std::vector<Part> parts_;
  std::map<Key, std::size_t> known_;
};

/// What a node may say only of certain meshes.
void check_node(const GltfNode& node, const std::vector<GltfMesh>& meshes) {
  if (!node.mesh) return;
  const GltfMesh& mesh = meshes[*node.mesh];
  if (node.skin && !mesh.has_joints) node.where.error("The node has a skin, and its mesh no joints.");
  if (node.weights != 0 && node.weights != mesh.targets) {
    node.where.member("weights")->error("The mesh has " + std::to_string(mesh.targets) + " morph targets, not " +
                                        std::to_string(node.weights) + ".");
  }
}

}  // namespace

Imported import_gltf(std::string_view bytes, std::string_view file_name, const CompanionSource& companions,
                     const ImportOptions& options, std::uint64_t texture_bytes, const std::stop_token& stop) {
  const GltfParts parts = take_apart(bytes, file_name);
  GltfFile file(parts.json, bytes.size(), file_name, companions, stop);
  check_asset(file);
  GltfBuffers buffers(file, parts);
  Accessors accessors(file, buffers);
  GltfTextures textures(file, buffers, texture_bytes);
  GltfMaterials materials(file, textures);
  const auto meshes = read_meshes(file, buffers, accessors, materials.used_uvs(), find_variant(file, options.variant));
  const auto cameras = read_cameras(file);
  const auto lights = read_lights(file);
  const auto skins = read_skins(file, accessors, file.root().array("nodes").size());
  const GltfNodes nodes =
      read_nodes(file, accessors, {meshes.size(), cameras.size(), lights.size(), skins.size()}, options.scene);
  for (const GltfNode& node : nodes.nodes) check_node(node, meshes);
  file.refuse_if_broken();

  Imported out;
  Assembly assembly(file, buffers, accessors, materials);
  for (const std::uint32_t i : nodes.in_scene) {
    const GltfNode& node = nodes.nodes[i];
    const Rows& to_world = *node.to_world;
    if (node.light) {
      if (const auto light = placed(lights[*node.light], to_world)) {
        out.lights.push_back(*light);
      } else {
        file.note(node.where, "A light is left out: its node's matrix gives it no place or direction");
      }
    }
    if (node.camera) {
      const GltfCamera& camera = cameras[*node.camera];
      const auto name = node.where.member("name");
      if (const auto in_place = placed(camera.camera, to_world)) {
        out.cameras.push_back({camera.name.empty() && name ? std::string(name->string()) : camera.name, *in_place});
      } else {
        file.note(node.where, "A camera is left out: its node's matrix gives it no direction");
      }
    }
    if (!node.mesh) continue;
    const GltfMesh& mesh = meshes[*node.mesh];
    if (mesh.targets > 0) file.note(node.where, "A mesh with morph targets is shown without them");
    if (node.skin) {
      file.note(node.where, "A mesh with a skin is shown as its joints stand before any animation");
      auto joints = joint_maps(skins[*node.skin], nodes, accessors, file, node.where);
      assembly.show(mesh, to_world,
                    joints.empty() ? nullptr : std::make_shared<const std::vector<Rows>>(std::move(joints)));
    } else if (node.instances.empty()) {
      assembly.show(mesh, to_world);
    }
    for (const Rows& instance : node.instances)
      if (!node.skin) assembly.show(mesh, to_world * instance);
    file.refuse_if_broken();
  }
  assembly.finish(out);
  file.refuse_if_broken();
  out.materials = materials.take();
  out.textures = textures.take();
  if (out.parts.empty()) file.notes().add("The file has no surfaces that are seen");
  out.warnings = file.notes().warnings();
  return out;
}

}  // namespace tessera::proto
