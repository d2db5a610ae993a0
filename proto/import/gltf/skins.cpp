#include "proto/import/gltf/skins.h"

#include <array>

namespace tessera::proto {

std::vector<GltfSkin> read_skins(GltfFile& file, const Accessors& accessors, std::size_t nodes) {
  std::vector<GltfSkin> skins;
  for (const JsonCursor& element : file.root().array("skins")) {
    const GltfObject object(element);
    GltfSkin& skin = skins.emplace_back();
    object.required("joints");
    for (const JsonCursor& joint : object.array("joints"))
      if (const auto node = read_reference(joint, nodes, "node")) skin.joints.push_back(*node);
    read_reference(object.find("skeleton"), nodes, "node");
    const auto matrices = object.find("inverseBindMatrices");
    skin.inverse_bind_matrices = read_reference(matrices, accessors.size(), "accessor");
    if (!skin.inverse_bind_matrices) continue;
    const Accessor& a = accessors[*skin.inverse_bind_matrices];
    if (a.is_known && !(a.is_matrix && a.components == 16 && a.type == ComponentType::float32)) {
      matrices->error("Inverse bind matrices are 4 by 4 floats.");
    } else if (a.is_known && a.count < skin.joints.size()) {
      matrices->error("There are fewer matrices than joints.");
    }
  }
  return skins;
}

std::vector<Rows> joint_maps(const GltfSkin& skin, const GltfNodes& nodes, Accessors& accessors, GltfFile& file,
                             const JsonCursor& where) {
  using Matrix = std::array<float, 16>;  // column by column
  std::vector<Rows> maps;
  std::vector<Matrix> inverse_binds;
  if (skin.inverse_bind_matrices) {
    const std::uint64_t bytes = accessors[*skin.inverse_bind_matrices].count * sizeof(Matrix);
    if (!file.take(bytes, where)) return maps;
    inverse_binds = accessors.read<Matrix>(*skin.inverse_bind_matrices);
    if (inverse_binds.empty()) return maps;
  }
  if (!file.take(skin.joints.size() * sizeof(Rows), where)) return maps;
  for (std::size_t i = 0; i < skin.joints.size(); ++i) {
    file.steps().take();
    const auto& to_world = nodes.nodes[skin.joints[i]].to_world;
    if (!to_world) {
      file.note(where, "A mesh is shown without its skin, whose joints aren't in the scene");
      return {};
    }
    Rows to_joint = kIdentity;
    for (std::size_t row = 0; row < 3 && !inverse_binds.empty(); ++row)
      for (std::size_t column = 0; column < 4; ++column)
        to_joint[row * 4 + column] = inverse_binds[i][column * 4 + row];
    maps.push_back(*to_world * to_joint);
  }
  return maps;
}

}  // namespace tessera::proto
