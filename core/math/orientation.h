#pragma once

#include "core/math/vec.h"

namespace tessera {

// Exact predicates on points whose coordinates are floats, over the whole range of floats, denormals included. Decided
// in double where its error bound allows (Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and Fast Robust
// Geometric Predicates"), otherwise in whole numbers. Pure; precondition: coordinates are finite.

/// 1 when `d` lies on the side of the plane abc to which (b − a) × (c − a) points, i.e. from which a, b, c run
/// counter-clockwise; −1 on the other side; 0 when the four lie in a plane.
int orientation(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

/// The sign of ((b − a) × (c − a))[axis]: whether a, b, c run counter-clockwise when looked at against that axis. The
/// three lie on a line when it is 0 for all three axes.
int orientation_along(int axis, Vec3 a, Vec3 b, Vec3 c);

/// det(direction, p − origin, q − origin): positive where the way from p to q turns counter-clockwise around the ray as
/// it is looked at from its end. Exact but for a last rounding: 0 only when the ray's line meets that of p and q.
double turning(Vec3 origin, Vec3 direction, Vec3 p, Vec3 q);

/// det(a − origin, b − origin, c − origin): six times the volume of the tetrahedron, positive where a, b, c run
/// clockwise seen from the origin. Exact but for a last rounding.
double volume(Vec3 origin, Vec3 a, Vec3 b, Vec3 c);

}  // namespace tessera
