#pragma once

#include <span>
#include <vector>

#include "core/bounds/convex_hull.h"

namespace tessera {

/// A direction across which a convex hull may be cut off.
struct Facet {
  Vec3d normal;       ///< Of length 1, outward.
  double weight = 0;  ///< The area of the hull's faces in this direction.
};

/// The facets of the hull of these points: its faces, those in one plane as one; beside these a bevel along each edge
/// that is sharp, so that what is flat, or flat but for rounding, is closed around its rim. A line has two across its
/// ends and four around it, a point none (its box closes it).
std::vector<Facet> facets_of(const ConvexHull& hull, std::span<const Vec3> points);

/// At most `count` of them: the heaviest one first, then, one by one, what is heavy and turned far from all before it.
std::vector<Facet> spread(std::vector<Facet> facets, std::size_t count);

/// Half the hull's surface area.
double half_area(const ConvexHull& hull, std::span<const Vec3> points);

}  // namespace tessera
