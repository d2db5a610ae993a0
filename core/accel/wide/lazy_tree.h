#pragma once

#include <atomic>
#include <concepts>
#include <functional>
#include <memory>
#include <mutex>

#include "core/accel/wide/wide_tree.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// The hierarchy of a mesh, and where it comes from.
struct MadeTree {
  WideTree tree;
  bool was_kept = false;  ///< From a run before this one: it wasn't built.
};

/// Makes hierarchies: builds them, or has them from where they are kept. What it gives is what `build_wide` would
/// build. Called by several threads at once, for different meshes.
using MakeTree = std::function<MadeTree(const TriangleMesh&)>;

/// The hierarchy of a mesh that is made when the first ray needs it, and never if none does. Safe for any number of
/// threads.
class LazyTree {
 public:
  struct Ready {
    MadeTree made;
    double seconds;  ///< That making it took.
  };

  /// The hierarchy. Who asks first makes it; who asks meanwhile waits. If making it throws, as with `BuildStop`, so
  /// does this, and the next one to ask tries again.
  template <std::invocable Make>
  const WideTree& get(const Make& make) const {
    const Ready* ready = this->ready();
    return (ready ? ready : make_ready(make))->made.tree;
  }

  /// What has been made; null as long as nothing has.
  const Ready* ready() const { return ready_.load(std::memory_order_acquire); }

 private:
  const Ready* make_ready(const std::function<MadeTree()>& make) const;

  mutable std::mutex making_;
  mutable std::unique_ptr<const Ready> made_;         ///< Apart, as of many hierarchies most may never be made.
  mutable std::atomic<const Ready*> ready_{nullptr};  ///< `made_`, once that is whole.
};

}  // namespace tessera
