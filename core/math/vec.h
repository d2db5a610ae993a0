#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace tessera {

/// Three components; a point or a direction as its name says. `Vec3` is float, metres; `Vec3d` carries
/// intermediate results that must not lose to cancellation.
template <typename T>
struct Vec {
  T x{}, y{}, z{};

  constexpr T operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr T& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr bool operator==(const Vec&) const = default;
};

using Vec3 = Vec<float>;
using Vec3d = Vec<double>;

template <typename T>
constexpr Vec<T> operator+(Vec<T> a, Vec<T> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename T>
constexpr Vec<T> operator-(Vec<T> a, Vec<T> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <typename T>
constexpr Vec<T> operator-(Vec<T> a) {
  return {-a.x, -a.y, -a.z};
}
template <typename T>
constexpr Vec<T> operator*(Vec<T> a, std::type_identity_t<T> s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <typename T>
constexpr Vec<T> operator*(std::type_identity_t<T> s, Vec<T> a) {
  return a * s;
}
template <typename T>
constexpr Vec<T> operator/(Vec<T> a, std::type_identity_t<T> s) {
  return {a.x / s, a.y / s, a.z / s};
}

template <typename T>
constexpr T dot(Vec<T> a, Vec<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename T>
constexpr Vec<T> cross(Vec<T> a, Vec<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename T>
T length(Vec<T> a) {
  return std::sqrt(dot(a, a));
}
template <typename T>
constexpr Vec<T> min(Vec<T> a, Vec<T> b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
template <typename T>
constexpr Vec<T> max(Vec<T> a, Vec<T> b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
template <typename T>
Vec<T> abs(Vec<T> a) {
  return {std::abs(a.x), std::abs(a.y), std::abs(a.z)};
}
template <typename T>
constexpr T max_component(Vec<T> a) {
  return std::max(a.x, std::max(a.y, a.z));
}
template <typename T>
bool is_finite(Vec<T> a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

constexpr Vec3d to_double(Vec3 a) { return {a.x, a.y, a.z}; }
constexpr Vec3 to_float(Vec3d a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }

}  // namespace tessera
