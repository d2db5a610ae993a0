// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_SEEN_TRIANGLES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SEEN_TRIANGLES_INL
#undef TESSERA_SEEN_TRIANGLES_INL
#else
#define TESSERA_SEEN_TRIANGLES_INL
#endif

#include "core/accel/wide/leaf-inl.h"
#include "core/accel/wide/picture-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Triangles of a leaf in the picture.
struct SeenTriangles {
  alignas(32) float u_lo[8], u_hi[8], v_lo[8], v_hi[8], nearness[8];
  /// Edge i's function is u·du[i] + v·dv[i] + at[i], not negative for rays that may pass inside; rays for which all
  /// three are `inside` or more surely do.
  alignas(32) float du[3][8], dv[3][8], at[3][8], inside[8];
  /// Base and by_edge[i] times the edges' functions is a nearness. A ray meets the plane at `error` more at most, and
  /// not less than `error` below `share` of it.
  alignas(32) float base[8], by_edge[3][8], error[8], share[8];
  alignas(32) std::uint32_t number[8];  ///< `kNobody` where it isn't sure which side a ray comes from.
  static constexpr std::uint32_t kNobody = kNoTriangle - 1;
};

/// What boxes cover of a picture, given where along the depth they lie. A box that reaches to the apex, or behind it,
/// has no end on the sides to which it lies.
struct AreaOf {
  HWY_INLINE AreaOf(const hn::Vec<F8>& near, const hn::Vec<F8>& far)
      : over_near(
            hn::IfThenElse(hn::Gt(near, hn::Zero(F8())), hn::Div(hn::Set(F8(), 1.0F), near), hn::Set(F8(), kInfinity))),
        over_far(hn::Div(hn::Set(F8(), 1.0F), far)) {}

  HWY_INLINE hn::Vec<F8> low(const hn::Vec<F8>& least) const {
    return hn::Mul(least, hn::IfThenElse(hn::Lt(least, hn::Zero(F8())), over_near, over_far));
  }
  HWY_INLINE hn::Vec<F8> high(const hn::Vec<F8>& most) const {
    return hn::Mul(most, hn::IfThenElse(hn::Gt(most, hn::Zero(F8())), over_near, over_far));
  }

  hn::Vec<F8> over_near, over_far;
};

/// What becomes of triangles that reach to the apex or behind it, to which `see` gives no end and no edges, and of
/// large ones with a corner nearby, whose place in the picture is vague.
///
/// Their edges are planes through the apex, e.g. normal a×b, and a ray's nearness is the sum of its places beside the
/// three over det(a, b, c). Let corners lie within m of the apex, within X, Y and Z of it along the picture's axes,
/// and d = um + 2uM, as far as they are off with what the ray's line passes the apex by. The normals' x is off by
/// 2d(Y + Z) + 2d² and roundings of 4uYZ, y and z alike. Functions of (u, v, 1), with |u| ≤ U and |v| ≤ V, are off by
/// what that makes, and by 12u(UYZ + VXZ + XY) for roundings of theirs and of u and v: 2.25d(U(Y + Z) + V(X + Z) + X
/// + Y + d(U + V + 1)) + 18u(UYZ + VXZ + XY) is more, and is added to them.
///
/// The determinant is off by d times the normals' sizes, |x| + |y| + |z|; since those are off too, and corners
/// together, and the exact routine's t, by less than 64d²m; and for roundings by less than 40u|a||b||c|, and than
/// 36uXYZ: long triangles have a small XYZ, triangles with one far corner small |b||c|. Where that, or 64u of it, is
/// a share h of it, less than a 16th, a nearness is at most 1 + 1.25h of what is computed, and that less 2.5h and six
/// times what was added is not more than it. Where cubes of m leave a float's range there are no edges. A triangle
/// that has edges either way takes those by which its nearness is less vague, or so it seems: both are right.
HWY_INLINE void see_from_apex(const Picture& picture, float start, const Leaf& leaf, std::size_t first,
                              const hn::Vec<F8>& nearest, const hn::Vec<F8>& farthest, SeenTriangles& seen) {
  const F8 f;
  const auto sign = hn::Set(f, picture.sign), stray = hn::Set(f, picture.stray), zero = hn::Zero(f);
  const std::uint32_t axes[3] = {picture.axes.x, picture.axes.y, picture.axes.z};
  struct Corner {
    hn::Vec<F8> x, y, z;
  };
  const auto corner = [&](std::size_t k) HWY_ATTR {
    const auto at = [&](int i) HWY_ATTR {
      const auto v = hn::LoadU(f, leaf.rows + first + (3 * k + axes[i]) * leaf.count);
      return hn::Mul(sign, hn::Sub(v, hn::Set(f, picture.apex[i])));
    };
    return Corner{at(0), at(1), at(2)};
  };
  const Corner a = corner(0), b = corner(1), c = corner(2);

  const auto reaches = hn::Le(nearest, zero);
  const AreaOf area_of(nearest, farthest);
  const auto box = [&](const auto& p, const auto& q, const auto& r, float* lo, float* hi) HWY_ATTR {
    const auto least = hn::Sub(hn::Min(p, hn::Min(q, r)), stray), most = hn::Add(hn::Max(p, hn::Max(q, r)), stray);
    hn::Store(hn::IfThenElse(reaches, area_of.low(least), hn::Load(f, lo)), f, lo);
    hn::Store(hn::IfThenElse(reaches, area_of.high(most), hn::Load(f, hi)), f, hi);
  };
  box(a.x, b.x, c.x, seen.u_lo + first, seen.u_hi + first);
  box(a.y, b.y, c.y, seen.v_lo + first, seen.v_hi + first);

  const auto across = [](const Corner& p, const Corner& q) HWY_ATTR {
    return Corner{hn::NegMulAdd(p.z, q.y, hn::Mul(p.y, q.z)), hn::NegMulAdd(p.x, q.z, hn::Mul(p.z, q.x)),
                  hn::NegMulAdd(p.y, q.x, hn::Mul(p.x, q.y))};
  };
  const auto most = [](const auto& p, const auto& q, const auto& r)
                        HWY_ATTR { return hn::Max(hn::Abs(p), hn::Max(hn::Abs(q), hn::Abs(r))); };
  const Corner normals[3] = {across(a, b), across(b, c), across(c, a)};
  const auto largest = [&](const Corner& p) HWY_ATTR { return most(p.x, p.y, p.z); };
  const auto size_a = largest(a), size_b = largest(b), size_c = largest(c);
  const auto x = most(a.x, b.x, c.x), y = most(a.y, b.y, c.y), z = most(a.z, b.z, c.z);
  const auto m = hn::Max(x, hn::Max(y, z));
  const auto unit = hn::Set(f, static_cast<float>(kUnitRoundoff));
  const auto d = hn::Mul(hn::MulAdd(m, unit, hn::Mul(stray, hn::Set(f, 0.125F))), hn::Set(f, kMore));
  // What is made of the three axes' terms in an edge's function.
  const auto function_of = [&](const auto& of_x, const auto& of_y, const auto& of_z) HWY_ATTR {
    return hn::MulAdd(of_x, hn::Set(f, picture.u_most), hn::MulAdd(of_y, hn::Set(f, picture.v_most), of_z));
  };
  const auto by_place = function_of(hn::Add(hn::Add(y, z), d), hn::Add(hn::Add(x, z), d), hn::Add(hn::Add(x, y), d));
  const auto by_rounding = function_of(hn::Mul(y, z), hn::Mul(x, z), hn::Mul(x, y));
  const auto slack =
      hn::MulAdd(hn::Mul(d, hn::Set(f, 2.25F)), by_place, hn::Mul(hn::Mul(unit, hn::Set(f, 18.0F)), by_rounding));
  const auto det = hn::MulAdd(normals[1].x, a.x, hn::MulAdd(normals[1].y, a.y, hn::Mul(normals[1].z, a.z)));
  const auto sizes = [&](const Corner& p)
                         HWY_ATTR { return hn::Add(hn::Abs(p.x), hn::Add(hn::Abs(p.y), hn::Abs(p.z))); };
  const auto normal_sizes = hn::Add(sizes(normals[0]), hn::Add(sizes(normals[1]), sizes(normals[2])));
  const auto size = hn::Abs(det);
  const auto by_corners = hn::Mul(d, hn::MulAdd(hn::Set(f, 64.0F), hn::Mul(d, m), normal_sizes));
  const auto by_roundings = hn::Mul(unit, hn::Min(hn::Mul(hn::Mul(size_a, hn::Set(f, 40.0F)), hn::Mul(size_b, size_c)),
                                                  hn::Mul(hn::Mul(x, hn::Set(f, 36.0F)), hn::Mul(y, z))));
  const auto off = hn::Max(hn::Add(by_corners, by_roundings), hn::Mul(hn::Mul(unit, hn::Set(f, 64.0F)), size));
  const auto in_range = hn::And(hn::Gt(off, hn::Set(f, 0x1p-120F)), hn::Lt(size, hn::Set(f, 0x1p120F)));
  const auto turned = hn::CopySignToAbs(hn::Set(f, 1.0F), det), h = hn::Div(off, size);
  const auto by_edge = hn::Div(hn::MulAdd(h, hn::Set(f, 1.25F), hn::Set(f, 1.0F)), size);
  const auto error = hn::Mul(hn::Mul(slack, by_edge), hn::Set(f, 6.0F));
  const auto has_sides = hn::And(hn::Gt(farthest, zero), hn::And(in_range, hn::Gt(size, off)));
  const auto is_sure = hn::And(has_sides, hn::Gt(size, hn::Mul(off, hn::Set(f, 16.0F))));
  const auto doubt = hn::Add(error, hn::Div(hn::Mul(h, hn::Set(f, 4.0F)), farthest));
  const auto numbers = hn::Load(U8(), seen.number + first);
  const auto unknown = hn::RebindMask(f, hn::Eq(numbers, hn::Set(U8(), SeenTriangles::kNobody)));
  const auto sure = hn::And(is_sure, hn::Or(unknown, hn::Lt(doubt, hn::Load(f, seen.error + first))));
  const auto sided = hn::Or(sure, hn::And(unknown, has_sides));
  for (int i = 0; i < 3; ++i) {
    hn::BlendedStore(hn::Mul(turned, normals[i].x), sided, f, seen.du[i] + first);
    hn::BlendedStore(hn::Mul(turned, normals[i].y), sided, f, seen.dv[i] + first);
    hn::BlendedStore(hn::MulAdd(turned, normals[i].z, slack), sided, f, seen.at[i] + first);
    hn::BlendedStore(by_edge, sure, f, seen.by_edge[i] + first);
  }
  hn::BlendedStore(zero, sure, f, seen.base + first);
  hn::BlendedStore(hn::NegMulAdd(h, hn::Set(f, 2.5F), hn::Set(f, 1.0F)), sure, f, seen.share + first);
  hn::BlendedStore(error, sure, f, seen.error + first);
  const auto sum = [](const auto& p, const auto& q, const auto& r)
                       HWY_ATTR { return hn::Abs(hn::Add(p, hn::Add(q, r))); };
  const auto nearest_place =
      function_of(sum(normals[0].x, normals[1].x, normals[2].x), sum(normals[0].y, normals[1].y, normals[2].y),
                  sum(normals[0].z, normals[1].z, normals[2].z));
  const auto after_start = hn::Lt(hn::MulAdd(nearest_place, by_edge, error), hn::Set(f, start));
  hn::BlendedStore(hn::IfThenElse(after_start, hn::Add(slack, slack), hn::Set(f, kInfinity)), sure, f,
                   seen.inside + first);
  hn::Store(hn::IfThenElse(hn::RebindMask(U8(), sure), leaf.triangles(first), numbers), U8(), seen.number + first);
}

/// A leaf's triangles in the picture.
///
/// Let p be the greatest of (stray/depth)·(1 + |x/depth|) over the corners. A corner is off by 5/16 of that, with
/// what the ray's line passes the apex by. Edge functions of rays that do pass inside lie within the triangle's
/// extent l in the picture, so their error is less than 2.5pl + 0.8p², and p·l for roundings: 5p(l + p) is more, and
/// is added to them. A triangle whose winding in the picture isn't certain is left to the exact routine everywhere in
/// its area.
///
/// Nearness, 1/depth, of a corner is off by a share of 6.1u·M/depth. Along the triangle it is corner a's, and shares
/// of what b's and c's are more: edge functions over the area, each off by the slack, and the area by as much. With
/// what the ray's line passes the apex by, the roundings of all this and of a hit's t, less than `error`.
HWY_INLINE void see(const Picture& picture, float start, const Leaf& leaf, std::size_t first, SeenTriangles& seen) {
  const F8 f;
  const auto sign = hn::Set(f, picture.sign), stray = hn::Set(f, picture.stray), zero = hn::Zero(f),
             one = hn::Set(f, 1.0F);
  struct Corner {
    hn::Vec<F8> u, v, depth, near;
  };
  const float* const rows = leaf.rows + first;
  const float* const row[3] = {rows + picture.axes.x * leaf.count, rows + picture.axes.y * leaf.count,
                               rows + picture.axes.z * leaf.count};
  const auto relative = [&](std::size_t k, int i) HWY_ATTR {
    return hn::Sub(hn::LoadU(f, row[i] + 3 * leaf.count * k), hn::Set(f, picture.apex[i]));
  };
  const auto corner = [&](std::size_t k) HWY_ATTR {
    const auto z = relative(k, 2), over = hn::Div(one, z);
    return Corner{hn::Mul(relative(k, 0), over), hn::Mul(relative(k, 1), over), hn::Mul(sign, z), hn::Mul(sign, over)};
  };
  const Corner a = corner(0), b = corner(1), c = corner(2);
  const auto min3 = [](const auto& p, const auto& q, const auto& r) HWY_ATTR { return hn::Min(p, hn::Min(q, r)); };
  const auto max3 = [](const auto& p, const auto& q, const auto& r) HWY_ATTR { return hn::Max(p, hn::Max(q, r)); };
  const auto nearest = hn::Sub(min3(a.depth, b.depth, c.depth), stray);
  const auto u_lo = min3(a.u, b.u, c.u), u_hi = max3(a.u, b.u, c.u);
  const auto v_lo = min3(a.v, b.v, c.v), v_hi = max3(a.v, b.v, c.v);
  const auto largest = hn::Max(hn::Max(hn::Neg(u_lo), u_hi), hn::Max(hn::Neg(v_lo), v_hi));
  const auto near = hn::Div(one, nearest), off = hn::Mul(stray, near);
  const auto p = hn::Mul(off, hn::Add(one, largest));
  const auto extent = hn::Max(hn::Sub(u_hi, u_lo), hn::Sub(v_hi, v_lo));
  const auto slack = hn::Mul(hn::Mul(hn::Set(f, 5.0F), p), hn::Add(extent, p));
  const auto area = hn::NegMulAdd(hn::Sub(b.v, a.v), hn::Sub(c.u, a.u), hn::Mul(hn::Sub(b.u, a.u), hn::Sub(c.v, a.v)));
  const auto known = hn::And(hn::Gt(nearest, zero), hn::Gt(hn::Abs(area), hn::Add(slack, slack)));
  const auto farthest = hn::Add(max3(a.depth, b.depth, c.depth), stray);
  hn::Store(hn::Sub(u_lo, p), f, seen.u_lo + first);
  hn::Store(hn::Add(u_hi, p), f, seen.u_hi + first);
  hn::Store(hn::Sub(v_lo, p), f, seen.v_lo + first);
  hn::Store(hn::Add(v_hi, p), f, seen.v_hi + first);
  const auto reaches = hn::Le(nearest, zero);
  // Behind the apex altogether: there is nothing so far off.
  const auto nearness = hn::IfThenElse(
      hn::Le(farthest, zero), hn::Set(f, -1.0F),
      hn::IfThenElse(reaches, hn::Set(f, FanRays::kNearest), hn::Min(near, hn::Set(f, FanRays::kNearest))));
  hn::Store(nearness, f, seen.nearness + first);
  const auto turned = hn::CopySignToAbs(one, area);
  const auto edge = [&](int i, const Corner& from, const Corner& to) HWY_ATTR {
    const auto along_u = hn::Mul(turned, hn::Sub(to.u, from.u)), along_v = hn::Mul(turned, hn::Sub(to.v, from.v));
    const auto at = hn::Add(hn::NegMulAdd(along_u, from.v, hn::Mul(along_v, from.u)), slack);
    hn::Store(hn::IfThenElseZero(known, hn::Neg(along_v)), f, seen.du[i] + first);
    hn::Store(hn::IfThenElseZero(known, along_u), f, seen.dv[i] + first);
    hn::Store(hn::IfThenElse(known, at, one), f, seen.at[i] + first);
  };
  edge(0, a, b);
  edge(1, b, c);
  edge(2, c, a);

  const auto over_area = hn::Div(one, hn::Abs(area));
  const auto by_edge = [&](const Corner& k) HWY_ATTR { return hn::Mul(hn::Sub(k.near, a.near), over_area); };
  const auto by_edge0 = by_edge(c), by_edge2 = by_edge(b);
  const auto base = hn::NegMulAdd(slack, hn::Add(by_edge0, by_edge2), a.near);
  const auto error = hn::MulAdd(hn::Mul(hn::Set(f, 4.0F), slack), hn::Add(hn::Abs(by_edge0), hn::Abs(by_edge2)),
                                hn::Mul(near, hn::Add(off, off)));
  const auto after_start = hn::Lt(hn::Add(near, error), hn::Set(f, start));
  hn::Store(hn::IfThenElseZero(known, by_edge0), f, seen.by_edge[0] + first);
  hn::Store(zero, f, seen.by_edge[1] + first);
  hn::Store(hn::IfThenElseZero(known, by_edge2), f, seen.by_edge[2] + first);
  hn::Store(hn::IfThenElse(known, base, nearness), f, seen.base + first);
  hn::Store(hn::IfThenElseZero(known, error), f, seen.error + first);
  hn::Store(one, f, seen.share + first);
  hn::Store(hn::IfThenElse(hn::And(known, after_start), hn::Add(slack, slack), hn::Set(f, kInfinity)), f,
            seen.inside + first);
  hn::Store(hn::IfThenElse(hn::RebindMask(U8(), known), leaf.triangles(first), hn::Set(U8(), SeenTriangles::kNobody)),
            U8(), seen.number + first);
  const auto is_close = hn::And(hn::Lt(nearest, hn::Set(f, 0.125F * picture.reach)), hn::Gt(extent, one));
  if (!hn::AllFalse(f, hn::Or(reaches, is_close))) see_from_apex(picture, start, leaf, first, nearest, farthest, seen);
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
