// Laws of the wide hierarchy, whatever mesh it is built over: boxes hold what lies below them in exact arithmetic, and
// every part of every triangle is below some path of boxes.
#include "core/accel/wide/wide_build.h"

#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/exact_sum.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

/// Whether child i's box, taken exactly, holds a point.
bool holds(const WideNode& node, int i, Vec3d p) {
  for (int axis = 0; axis < 3; ++axis) {
    const double step = node.step[axis];
    if (compare_sum(node.origin[axis], node.lo[axis][i] * step, p[axis]) > 0) return false;
    if (compare_sum(node.origin[axis], node.hi[axis][i] * step, p[axis]) < 0) return false;
  }
  return true;
}

struct Path {
  std::vector<std::pair<std::uint32_t, int>> steps;  ///< Node and child, from the root.
};

/// A tree taken apart: the paths that lead to each triangle; on the way it checks what each node and leaf alone says.
class Anatomy {
 public:
  Anatomy(const TriangleMesh& mesh, const WideTree& tree, std::uint32_t leaf_size)
      : mesh_(mesh), tree_(tree), leaf_size_(leaf_size) {
    if (!tree.nodes.empty()) visit(0);
    EXPECT_EQ(nodes_.size(), tree.nodes.size()) << "every node is reached";
    EXPECT_EQ(tree.stats.nodes, tree.nodes.size());
    EXPECT_EQ(tree.stats.leaves, leaves_);
    EXPECT_EQ(tree.stats.depth, depth_);
    EXPECT_LE(depth_, static_cast<std::uint32_t>(WideTree::kMostDepth));
    EXPECT_EQ(tree.stats.bytes, tree.nodes.size_bytes() + tree.leaves.size_bytes());
    EXPECT_GE(tree.leaves.size(), words_ + WideTree::kSlack);
  }

  const std::vector<Path>& paths(std::uint32_t triangle) { return paths_[triangle]; }
  std::size_t triangles() const { return paths_.size(); }
  std::size_t references() const { return references_; }

 private:
  void visit(std::uint32_t number) {
    ASSERT_LT(number, tree_.nodes.size());
    ASSERT_TRUE(nodes_.insert(number).second) << "a node has one parent";
    const WideNode& node = tree_.nodes[number];
    depth_ = std::max(depth_, static_cast<std::uint32_t>(path_.steps.size() + 1));
    int children = 0;
    while (children < WideNode::kChildren && node.child[children] != kNoChild) ++children;
    ASSERT_GT(children, 0);
    check_empty_slots(node, children);
    check_orders(node, children);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_TRUE(std::isfinite(node.origin[axis]));
      EXPECT_TRUE(std::isnormal(node.step[axis]) && node.step[axis] > 0);
    }
    for (int i = 0; i < children; ++i) {
      path_.steps.emplace_back(number, i);
      if (WideChild::is_leaf(node.child[i]))
        leaf(node.child[i]);
      else
        visit(node.child[i]);
      path_.steps.pop_back();
    }
  }

  static void check_empty_slots(const WideNode& node, int children) {
    for (int i = children; i < WideNode::kChildren; ++i) {
      EXPECT_EQ(node.child[i], kNoChild);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(node.lo[axis][i], node.lo[axis][0]);
        EXPECT_EQ(node.hi[axis][i], node.hi[axis][0]);
      }
    }
  }

  /// Permutations, in which children come first, and where none of two boxes apart on all axes is on the wrong side.
  static void check_orders(const WideNode& node, int children) {
    for (int octant = 0; octant < 8; ++octant) {
      const std::uint8_t* order = node.order[octant];
      const std::uint32_t bits = order[0] | std::uint32_t{order[1]} << 8 | std::uint32_t{order[2]} << 16;
      std::array<int, WideNode::kChildren> child, sorted;
      for (int place = 0; place < WideNode::kChildren; ++place) child[place] = sorted[place] = bits >> (3 * place) & 7;
      std::sort(sorted.begin(), sorted.end());
      for (int i = 0; i < WideNode::kChildren; ++i) EXPECT_EQ(sorted[i], i);
      for (int near = 0; near < children; ++near) {
        EXPECT_LT(child[near], children);
        for (int far = near + 1; far < children; ++far) EXPECT_FALSE(is_behind(node, child[near], child[far], octant));
      }
    }
  }

  /// Whether a lies beyond b along every axis for rays of the octant.
  static bool is_behind(const WideNode& node, int a, int b, int octant) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool down = octant >> axis & 1;
      if (!(down ? node.hi[axis][a] < node.lo[axis][b] : node.lo[axis][a] > node.hi[axis][b])) return false;
    }
    return true;
  }

  void leaf(std::uint32_t child) {
    const std::uint32_t count = WideChild::count(child);
    const std::size_t at = std::size_t{WideChild::at(child)} * 4;
    ASSERT_GE(count, 1U);
    ASSERT_LE(count, leaf_size_);
    ASSERT_LE(at + leaf_words(count), tree_.leaves.size());
    const std::uint32_t* words = tree_.leaves.data() + at;
    std::set<std::uint32_t> here;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t triangle = words[9 * count + i];
      ASSERT_LT(triangle, mesh_.triangles.size());
      EXPECT_TRUE(here.insert(triangle).second) << "a triangle stands in a leaf once";
      for (std::uint32_t row = 0; row < 9; ++row)
        EXPECT_EQ(std::bit_cast<float>(words[row * count + i]),
                  mesh_.positions[mesh_.triangles[triangle][row / 3]][static_cast<int>(row % 3)]);
      paths_[triangle].push_back(path_);
    }
    ++leaves_;
    references_ += count;
    words_ += leaf_words(count);
  }

  const TriangleMesh& mesh_;
  const WideTree& tree_;
  std::uint32_t leaf_size_;
  Path path_;
  std::map<std::uint32_t, std::vector<Path>> paths_;
  std::set<std::uint32_t> nodes_;
  std::uint64_t leaves_ = 0;
  std::size_t words_ = 0, references_ = 0;
  std::uint32_t depth_ = 0;
};

bool holds(const WideTree& tree, const Path& path, Vec3d p) {
  return std::all_of(path.steps.begin(), path.steps.end(),
                     [&](const auto& step) { return holds(tree.nodes[step.first], step.second, p); });
}

/// Every corner of a triangle that isn't split, and every one of some points of a split one, is below a path.
void check(const TriangleMesh& mesh, const WideBuildOptions& options) {
  const WideTree tree = build_wide(mesh, options);
  Anatomy anatomy(mesh, tree, options.leaf_size);
  ASSERT_EQ(anatomy.triangles(), mesh.triangles.size());
  if (!options.spatial_splits) {
    EXPECT_EQ(anatomy.references(), mesh.triangles.size());
  }
  Random random(mesh.triangles.size());
  Aabb all;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    std::array<Vec3d, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      corners[c] = to_double(mesh.positions[mesh.triangles[i][c]]);
      all.extend(to_float(corners[c]));
    }
    const std::vector<Path>& paths = anatomy.paths(i);
    const auto reached = [&](Vec3d p) {
      return std::any_of(paths.begin(), paths.end(), [&](const Path& path) { return holds(tree, path, p); });
    };
    for (const Vec3d corner : corners) ASSERT_TRUE(reached(corner)) << "triangle " << i;
    if (paths.size() == 1) continue;
    for (int k = 0; k < 30; ++k) {
      double u = random.uniform(0, 1), v = random.uniform(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      if (k % 3 == 0) u = 0;
      ASSERT_TRUE(reached(corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v)) << i;
    }
  }
  EXPECT_EQ(tree.root, all);
}

void check_all_ways(const TriangleMesh& mesh) {
  for (const bool spatial_splits : {false, true})
    for (const std::uint32_t leaf_size : {1U, 4U, 8U}) {
      SCOPED_TRACE(testing::Message() << "leaves of " << leaf_size << (spatial_splits ? ", split" : ""));
      check(mesh, {.leaf_size = leaf_size, .threads = 2, .spatial_splits = spatial_splits});
    }
}

void add(TriangleMesh& mesh, Vec3 a, Vec3 b, Vec3 c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// Triangles of any size and place within `extent`.
TriangleMesh soup(std::uint64_t seed, int count, double extent, double least_exponent = -4) {
  Random random(seed);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d center = random.in_cube() * extent;
    const double size = extent * random.magnitude(least_exponent, 0);
    const auto corner = [&] { return to_float(center + random.in_cube() * size); };
    const Vec3 a = corner(), b = corner();
    add(mesh, a, b, corner());
  }
  return mesh;
}

TEST(WideBuild, NothingIsATreeWithoutNodes) {
  const WideTree tree = build_wide({});
  EXPECT_TRUE(tree.root.empty());
  EXPECT_TRUE(tree.nodes.empty());
  EXPECT_EQ(tree.stats.depth, 0U);
  EXPECT_GE(tree.leaves.size(), WideTree::kSlack);
}

TEST(WideBuild, AFewTriangles) {
  for (int count = 1; count < 40; ++count) {
    SCOPED_TRACE(count);
    check_all_ways(soup(static_cast<std::uint64_t>(count), count, 1));
  }
}

TEST(WideBuild, Soups) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    check_all_ways(soup(seed, 700, 10, seed % 2 ? -4 : -1));
  }
}

TEST(WideBuild, ClosedMeshes) { check_all_ways(icosphere(4, 3, {100, -20, 7})); }

TEST(WideBuild, FlatMeshes) { check_all_ways(grid_plane(20)); }

TEST(WideBuild, CoordinatesOfAnyMagnitude) {
  for (const double extent : {4e17, 1e9, 1e-20, 1e-37, 1e-40, 1e-44}) {
    SCOPED_TRACE(extent);
    check_all_ways(soup(1, 200, extent, -2));
  }
  TriangleMesh mixed = soup(2, 100, 1e17);
  for (const double extent : {1e-44, 1e-3, 1.0, 1e9})
    for (const Vec3 p : soup(3, 50, extent).positions) mixed.positions.push_back(p);
  for (std::uint32_t i = 300; i < mixed.positions.size(); i += 3) mixed.triangles.push_back({i, i + 1, i + 2});
  check_all_ways(mixed);
}

TEST(WideBuild, TrianglesOnALine) {
  TriangleMesh mesh;
  for (int i = 0; i < 300; ++i) {
    const auto x = static_cast<float>(i * i);
    add(mesh, {x, x, x}, {x + 1, x + 1, x + 1}, {x + 3, x + 3, x + 3});
  }
  check_all_ways(mesh);
}

/// Distances that halve, so that equal bins take one triangle off at a time.
TEST(WideBuild, ClustersWithinClustersStayShallow) {
  TriangleMesh mesh;
  for (int i = 0; i < 200; ++i) {
    const float x = std::ldexp(1.0F, 50 - i);
    for (int k = 0; k < 3; ++k) add(mesh, {x, 0, 0}, {x, x, 0}, {x, 0, x});
  }
  check_all_ways(mesh);
}

TEST(WideBuild, TwinsStayShallow) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 2}};
  mesh.triangles.assign(100000, {0, 1, 2});
  const WideTree tree = build_wide(mesh);
  EXPECT_LE(tree.stats.depth, 16U);
  mesh.triangles.resize(5000);
  check_all_ways(mesh);
}

/// Long walls side by side, turned by 30° about two axes, with small things between them.
TriangleMesh turned_walls(int walls, int things) {
  TriangleMesh mesh;
  const auto turned = [](double x, double y, double z) {
    const double u = 0.866 * x - 0.5 * y, v = 0.5 * x + 0.866 * y;
    return to_float(Vec3d{0.866 * u - 0.5 * z, v, 0.5 * u + 0.866 * z});
  };
  Random random(11);
  for (int i = 0; i < walls; ++i) {
    add(mesh, turned(0, i, 0), turned(100, i, 0), turned(100, i, 30));
    add(mesh, turned(0, i, 0), turned(100, i, 30), turned(0, i, 30));
  }
  for (int i = 0; i < things; ++i) {
    const double x = random.uniform(0, 100), y = random.uniform(0, walls), z = random.uniform(0, 30);
    add(mesh, turned(x, y, z), turned(x + 0.1, y, z), turned(x, y + 0.1, z + 0.1));
  }
  return mesh;
}

/// Half areas of all boxes but the root's, each once for a node and once for a leaf.
double expected_visits(const WideTree& tree) {
  double sum = 0;
  for (const WideNode& node : tree.nodes)
    for (int i = 0; i < WideNode::kChildren && node.child[i] != kNoChild; ++i) {
      Vec3d size;
      for (int axis = 0; axis < 3; ++axis) size[axis] = double{node.step[axis]} * (node.hi[axis][i] - node.lo[axis][i]);
      sum += size.x * size.y + size.y * size.z + size.z * size.x;
    }
  return sum;
}

/// And use it up.
TEST(WideBuild, LongTrianglesAreCutWithinTheirAllowance) {
  const TriangleMesh mesh = turned_walls(100, 2000);
  check_all_ways(mesh);
  const WideTree cut = build_wide(mesh), whole = build_wide(mesh, {.spatial_splits = false});
  const std::size_t references = Anatomy(mesh, cut, WideBuildOptions().leaf_size).references();
  EXPECT_GT(references, mesh.triangles.size() * 12 / 10);
  EXPECT_LE(references, mesh.triangles.size() * 13 / 10);
  EXPECT_LT(expected_visits(cut), 0.75 * expected_visits(whole));
}

TEST(WideBuild, NeedlesAllThroughEachOther) {
  Random random(3);
  TriangleMesh mesh;
  for (int i = 0; i < 6000; ++i) {
    const Vec3d a = random.in_cube(), b = random.in_cube();
    add(mesh, to_float(a), to_float(b), to_float(b + random.in_cube() * 1e-3));
  }
  check_all_ways(mesh);
}

TEST(WideBuild, SurfacesOfSmallTrianglesAreNotCut) {
  for (const TriangleMesh& mesh : {icosphere(5, 2, {1, 2, 3}), grid_plane(50)})
    EXPECT_EQ(Anatomy(mesh, build_wide(mesh), WideBuildOptions().leaf_size).references(), mesh.triangles.size());
}

TEST(WideBuild, TheNumberOfThreadsChangesNothing) {
  for (const TriangleMesh& mesh : {turned_walls(300, 40000), soup(5, 30000, 1), icosphere(6)}) {
    const WideTree one = build_wide(mesh, {.threads = 1});
    for (const unsigned threads : {0U, 2U, 7U}) {
      const WideTree many = build_wide(mesh, {.threads = threads});
      EXPECT_EQ(many.root, one.root);
      ASSERT_EQ(many.nodes.size(), one.nodes.size());
      ASSERT_EQ(many.leaves.size(), one.leaves.size());
      EXPECT_EQ(std::memcmp(many.nodes.data(), one.nodes.data(), one.nodes.size_bytes()), 0);
      EXPECT_EQ(std::memcmp(many.leaves.data(), one.leaves.data(), one.leaves.size_bytes()), 0);
      EXPECT_EQ(many.stats.depth, one.stats.depth);
    }
  }
}

TEST(WideBuild, LargeMeshesAreWholeToo) {
  check(turned_walls(300, 20000), {.threads = 2});
  check(icosphere(6), {.threads = 2});
}

TEST(WideBuild, ArraysBeginOnCacheLines) {
  const WideTree tree = build_wide(icosphere(3));
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(tree.nodes.data()) % 64, 0U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(tree.leaves.data()) % 64, 0U);
}

TEST(WideBuild, TooManyTrianglesAreRefused) {
  if (!long_tests()) GTEST_SKIP() << "takes 640 MB: TESSERA_LONG_TESTS=1";
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 2}};
  mesh.triangles.assign(54'000'000, {0, 1, 2});
  EXPECT_THROW(build_wide(mesh), std::length_error);
}

/// Every box has one leaf, below nodes that hold it; empty ones have none.
void expect_holds_boxes(const WideTree& tree, std::span<const Aabb> boxes) {
  std::vector<int> leaves(boxes.size());
  const auto visit = [&](const auto& self, std::uint32_t number,
                         std::vector<std::pair<std::uint32_t, int>> path) -> void {
    for (int i = 0; i < WideNode::kChildren; ++i) {
      const std::uint32_t child = tree.nodes[number].child[i];
      if (child == kNoChild) continue;
      auto below = path;
      below.emplace_back(number, i);
      if (!WideChild::is_leaf(child)) {
        self(self, child, below);
        continue;
      }
      ASSERT_LT(WideChild::at(child), boxes.size());
      ++leaves[WideChild::at(child)];
      const Aabb& box = boxes[WideChild::at(child)];
      for (const auto& [node, slot] : below)
        for (const Vec3 corner : {box.lo, box.hi}) EXPECT_TRUE(holds(tree.nodes[node], slot, to_double(corner)));
    }
  };
  visit(visit, 0, {});
  for (std::size_t i = 0; i < boxes.size(); ++i) EXPECT_EQ(leaves[i], boxes[i].empty() ? 0 : 1) << i;
}

TEST(WideBuildOver, HoldsEveryBoxOnce) {
  for (const std::size_t count : {1U, 2U, 9U, 3000U}) {
    Random random(count);
    std::vector<Aabb> boxes(count);
    for (std::size_t i = 0; i < count; ++i) {
      if (i % 7 == 3) continue;                                               // stays empty
      const Vec3 at = to_float(random.in_cube() * (i % 5 == 0 ? 0.0 : 1e3));  // some in one place
      boxes[i].extend(at);
      if (i % 3 != 0) boxes[i].extend(at + to_float(random.in_cube() * random.magnitude(-3, 3)));
    }
    const WideTree tree = build_wide_over(boxes, 1);
    expect_holds_boxes(tree, boxes);
    const WideTree by_two = build_wide_over(boxes, 2);
    ASSERT_EQ(by_two.nodes.size(), tree.nodes.size());
    EXPECT_EQ(std::memcmp(by_two.nodes.data(), tree.nodes.data(), tree.nodes.size_bytes()), 0);
  }
}

TEST(WideBuildOver, OfNothingIsNothing) {
  EXPECT_TRUE(build_wide_over({}).nodes.empty());
  EXPECT_TRUE(build_wide_over(std::vector<Aabb>(3)).root.empty());
}

}  // namespace
}  // namespace tessera
