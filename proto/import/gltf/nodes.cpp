#include "proto/import/gltf/nodes.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace tessera::proto {

Rows operator*(const Rows& a, const Rows& b) {
  Rows out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      out[i * 4 + j] =
          a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] + (j == 3 ? a[i * 4 + 3] : 0);
    }
  }
  return out;
}

Vec3d transform_vector(const Rows& m, Vec3d v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

Vec3d transform_point(const Rows& m, Vec3d p) { return transform_vector(m, p) + Vec3d{m[3], m[7], m[11]}; }

double determinant(const Rows& m) {
  return dot(cross(Vec3d{m[0], m[4], m[8]}, Vec3d{m[1], m[5], m[9]}), {m[2], m[6], m[10]});
}

namespace {

using Quaternion = std::array<double, 4>;  // x, y, z, w

double norm(const Quaternion& q) { return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); }

/// Precondition: the quaternion isn't zero.
Rows placement(Vec3d translation, const Quaternion& rotation, Vec3d scale) {
  const double n = norm(rotation);
  const double x = rotation[0] / n, y = rotation[1] / n, z = rotation[2] / n, w = rotation[3] / n;
  return {(1 - 2 * (y * y + z * z)) * scale.x, 2 * (x * y - w * z) * scale.y,
          2 * (x * z + w * y) * scale.z,       translation.x,
          2 * (x * y + w * z) * scale.x,       (1 - 2 * (x * x + z * z)) * scale.y,
          2 * (y * z - w * x) * scale.z,       translation.y,
          2 * (x * z - w * y) * scale.x,       2 * (y * z + w * x) * scale.y,
          (1 - 2 * (x * x + y * y)) * scale.z, translation.z};
}

/// How far a rotation's length may be from 1: what rounding to bytes leaves, as the validator of Khronos has it.
constexpr double kUnitTolerance = 0.00769;

/// Whether the columns of the linear part are perpendicular: it is a rotation and a scale then.
bool is_rotation_and_scale(const Rows& m) {
  const Vec3d x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const auto perpendicular = [](Vec3d a, Vec3d b) { return std::abs(dot(a, b)) <= 1e-3 * length(a) * length(b); };
  return perpendicular(x, y) && perpendicular(y, z) && perpendicular(z, x);
}

class NodeReader {
 public:
  NodeReader(GltfFile& file, Accessors& accessors, const NodeReferences& references)
      : file_(file), accessors_(accessors), references_(references) {}

  GltfNodes read_all(std::optional<std::uint32_t> asked) {
    const auto objects = file_.root().array("nodes");
    count_ = objects.size();
    out_.nodes.reserve(count_);
    for (const JsonCursor& object : objects) read_node(GltfObject(object));
    find_parents();
    refuse_loops();
    const auto roots = roots_of_scene(asked);
    if (file_.errors().empty()) walk(roots);
    return std::move(out_);
  }

 private:
  void read_node(const GltfObject& object) {
    file_.steps().take();
    GltfNode& node = out_.nodes.emplace_back(GltfNode{.where = object.value()});
    read_placement(object, node);
    const auto mesh = object.find("mesh"), skin = object.find("skin"), weights = object.find("weights");
    node.mesh = read_reference(mesh, references_.meshes, "mesh");
    node.camera = read_reference(object.find("camera"), references_.cameras, "camera");
    node.skin = read_reference(skin, references_.skins, "skin");
    if (skin && !mesh) skin->error("A node with a skin needs a mesh.");
    if (weights && !mesh) weights->error("A node with weights needs a mesh.");
    node.weights = object.array("weights").size();
    if (const auto light = object.extension("KHR_lights_punctual"))
      node.light = read_reference(light->required("light"), references_.lights, "light");
    for (const JsonCursor& child : object.array("children")) {
      const auto at = read_reference(child, count_, "node");
      if (!at) continue;
      node.children.push_back(*at);
      places_.emplace_back(child);
    }
    if (const auto instancing = object.extension("EXT_mesh_gpu_instancing")) read_instances(*instancing, node);
  }

  void read_placement(const GltfObject& object, GltfNode& node) {
    std::array<double, 16> columns{};
    std::array<double, 3> translation{}, scale{1, 1, 1};
    Quaternion rotation{0, 0, 0, 1};
    const auto matrix = object.find("matrix"), t = object.find("translation"), r = object.find("rotation"),
               s = object.find("scale");
    if (matrix && (t || r || s)) {
      matrix->error("A node has either a matrix or a translation, a rotation and a scale.");
      return;
    }
    if (matrix) {
      if (!read_numbers(matrix, columns)) return;
      if (columns[3] != 0 || columns[7] != 0 || columns[11] != 0 || columns[15] != 1) {
        matrix->error("The last row of a node's matrix (every fourth number) is 0, 0, 0, 1.");
        return;
      }
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 4; ++column) node.to_parent[row * 4 + column] = columns[column * 4 + row];
      if (!is_rotation_and_scale(node.to_parent))
        matrix->error("A node's matrix can't be sheared: it is made of a translation, a rotation and a scale.");
      return;
    }
    if (!read_numbers(t, translation) || !read_numbers(r, rotation) || !read_numbers(s, scale)) return;
    if (std::abs(norm(rotation) - 1) > kUnitTolerance) {
      r->error("A rotation is a quaternion of length 1, not " + std::to_string(norm(rotation)) + ".");
      return;
    }
    if (t || r || s) {
      node.to_parent =
          placement({translation[0], translation[1], translation[2]}, rotation, {scale[0], scale[1], scale[2]});
    }
  }

  void read_instances(const GltfObject& extension, GltfNode& node) {
    extension.required("attributes");
    const auto attributes = extension.object("attributes");
    if (!attributes) return;
    std::optional<std::uint64_t> count;
    const auto find = [&](std::string_view name, std::uint32_t components) -> std::optional<std::uint32_t> {
      const auto field = attributes->find(name);
      const auto accessor = read_reference(field, accessors_.size(), "accessor");
      if (!accessor) return std::nullopt;
      const Accessor& a = accessors_[*accessor];
      const bool is_vector = a.is_known && a.components == components && !a.is_matrix;
      const bool is_quaternion = components == 4 && a.is_normalized;
      if (!is_vector || (a.type != ComponentType::float32 && !is_quaternion)) {
        field->error("This attribute has " + std::to_string(components) + " floats for each instance" +
                     (components == 4 ? ", or signed normalised integers." : "."));
        return std::nullopt;
      }
      if (!count) count = a.count;
      if (a.count == *count) return accessor;
      field->error("All attributes have the same number of instances.");
      return std::nullopt;
    };
    const auto t = find("TRANSLATION", 3), r = find("ROTATION", 4), s = find("SCALE", 3);
    if (!count || !file_.errors().empty()) return;
    if (!file_.take(*count * (sizeof(Rows) + 40), extension.value())) return;
    const auto translations = t ? accessors_.read<Vec3>(*t) : std::vector<Vec3>();
    const auto rotations = r ? accessors_.read<std::array<float, 4>>(*r) : std::vector<std::array<float, 4>>();
    const auto scales = s ? accessors_.read<Vec3>(*s) : std::vector<Vec3>();
    if (!file_.errors().empty()) return;
    for (std::size_t i = 0; i < *count; ++i) {
      file_.steps().take();
      Quaternion rotation{0, 0, 0, 1};
      if (r) rotation = {rotations[i][0], rotations[i][1], rotations[i][2], rotations[i][3]};
      const Rows rows = norm(rotation) > 0 ? placement(t ? to_double(translations[i]) : Vec3d{}, rotation,
                                                       s ? to_double(scales[i]) : Vec3d{1, 1, 1})
                                           : Rows{};  // which has no inverse, as is told then
      node.instances.push_back(rows);
    }
  }

  void find_parents() {
    auto place = places_.begin();
    for (std::uint32_t i = 0; i < out_.nodes.size(); ++i) {
      for (const std::uint32_t child : out_.nodes[i].children) {
        auto& parent = out_.nodes[child].parent;
        if (parent)
          place->error("Node " + std::to_string(child) + " is a child of node " + std::to_string(*parent) +
                       " already; a node has one parent.");
        else
          parent = i;
        ++place;
      }
    }
  }

  /// Climbs from every node to a root, or to where an earlier climb has been.
  void refuse_loops() {
    std::vector<std::uint32_t> climb(out_.nodes.size(), UINT32_MAX);  // in which each was met first
    for (std::uint32_t start = 0; start < out_.nodes.size(); ++start) {
      std::optional<std::uint32_t> at = start;
      for (; at && climb[*at] == UINT32_MAX; at = out_.nodes[*at].parent) climb[*at] = start;
      file_.steps().take();
      if (at && climb[*at] == start) out_.nodes[*at].where.error("The node is a descendant of itself.");
    }
  }

  std::vector<std::uint32_t> roots_of_scene(std::optional<std::uint32_t> asked) {
    const auto scenes = file_.root().array("scenes");
    const auto default_scene = read_reference(file_.root().find("scene"), scenes.size(), "scene");
    std::vector<std::vector<std::uint32_t>> roots;
    for (const JsonCursor& element : scenes) {
      auto& of_scene = roots.emplace_back();
      for (const JsonCursor& node : GltfObject(element).array("nodes")) {
        const auto root = read_reference(node, count_, "node");
        if (!root) continue;
        if (out_.nodes[*root].parent) node.error("Node " + std::to_string(*root) + " is no root: it has a parent.");
        of_scene.push_back(*root);
      }
    }
    if (asked && *asked >= scenes.size()) {
      file_.refuse_option("scene", "There is no scene " + std::to_string(*asked) + "; the file has " +
                                       std::to_string(scenes.size()) + ".");
    } else if (asked || !roots.empty()) {
      return roots[asked.value_or(default_scene.value_or(0))];
    }
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < out_.nodes.size(); ++i)
      if (!out_.nodes[i].parent) all.push_back(i);
    return all;
  }

  void walk(const std::vector<std::uint32_t>& roots) {
    std::vector<std::uint32_t> open(roots.rbegin(), roots.rend());
    while (!open.empty()) {
      file_.steps().take();
      const std::uint32_t at = open.back();
      open.pop_back();
      GltfNode& node = out_.nodes[at];
      if (node.to_world) continue;  // a scene may name a root twice
      node.to_world = node.parent ? *out_.nodes[*node.parent].to_world * node.to_parent : node.to_parent;
      out_.in_scene.push_back(at);
      open.insert(open.end(), node.children.rbegin(), node.children.rend());
    }
  }

  GltfFile& file_;
  Accessors& accessors_;
  const NodeReferences& references_;
  std::size_t count_ = 0;
  std::vector<JsonCursor> places_;  ///< Of all children, in the order of the document.
  GltfNodes out_;
};

}  // namespace

GltfNodes read_nodes(GltfFile& file, Accessors& accessors, const NodeReferences& references,
                     std::optional<std::uint32_t> scene) {
  return NodeReader(file, accessors, references).read_all(scene);
}

}  // namespace tessera::proto
