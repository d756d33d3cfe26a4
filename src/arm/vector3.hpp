#pragma once

#include "torsio/arm/arm_model.hpp"

// Vectors of three values and rotations, in sizes that the compiler keeps in registers.

namespace torsio {

inline Vector3 operator+(const Vector3& a, const Vector3& b) noexcept {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vector3 operator-(const Vector3& a, const Vector3& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vector3 operator*(double a, const Vector3& b) noexcept {
  return {a * b[0], a * b[1], a * b[2]};
}
inline double dot(const Vector3& a, const Vector3& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// R x
inline Vector3 rotated(const Matrix3& r, const Vector3& x) noexcept {
  return {r[0] * x[0] + r[1] * x[1] + r[2] * x[2], r[3] * x[0] + r[4] * x[1] + r[5] * x[2],
          r[6] * x[0] + r[7] * x[1] + r[8] * x[2]};
}
/// Rᵀ x
inline Vector3 rotated_back(const Matrix3& r, const Vector3& x) noexcept {
  return {r[0] * x[0] + r[3] * x[1] + r[6] * x[2], r[1] * x[0] + r[4] * x[1] + r[7] * x[2],
          r[2] * x[0] + r[5] * x[1] + r[8] * x[2]};
}
inline Matrix3 product(const Matrix3& a, const Matrix3& b) noexcept {
  Matrix3 of;
  for (std::size_t row = 0; row < 9; row += 3)
    for (std::size_t j = 0; j < 3; ++j)
      of[row + j] = a[row] * b[j] + a[row + 1] * b[3 + j] + a[row + 2] * b[6 + j];
  return of;
}
inline Matrix3 transposed(const Matrix3& r) noexcept {
  return {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]};
}
inline Vector3 column(const Matrix3& r, std::size_t j) noexcept {
  return {r[j], r[3 + j], r[6 + j]};
}

/// The frame `inner`, given in `outer`, in that in which `outer` is given.
inline ArmFrame product(const ArmFrame& outer, const ArmFrame& inner) noexcept {
  return {outer.position_m + rotated(outer.rotation, inner.position_m),
          product(outer.rotation, inner.rotation)};
}

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
using Symmetric3 = std::array<double, 6>;

inline Symmetric3 operator+(const Symmetric3& a, const Symmetric3& b) noexcept {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]};
}
/// S x
inline Vector3 times(const Symmetric3& s, const Vector3& x) noexcept {
  return {s[0] * x[0] + s[3] * x[1] + s[4] * x[2], s[3] * x[0] + s[1] * x[1] + s[5] * x[2],
          s[4] * x[0] + s[5] * x[1] + s[2] * x[2]};
}
/// R S Rᵀ
inline Symmetric3 rotated(const Matrix3& r, const Symmetric3& s) noexcept {
  const Vector3 x = times(s, {r[0], r[1], r[2]});
  const Vector3 y = times(s, {r[3], r[4], r[5]});
  const Vector3 z = times(s, {r[6], r[7], r[8]});
  const Vector3 row_y = {r[3], r[4], r[5]};
  const Vector3 row_z = {r[6], r[7], r[8]};
  return {r[0] * x[0] + r[1] * x[1] + r[2] * x[2],
          dot(row_y, y),
          dot(row_z, z),
          dot(row_y, x),
          dot(row_z, x),
          dot(row_z, y)};
}
/// 2 (a·b) 1 − a bᵀ − b aᵀ: for a = b twice the inertia of a unit mass at a.
inline Symmetric3 inertia_of(const Vector3& a, const Vector3& b) noexcept {
  const double x = a[0] * b[0];
  const double y = a[1] * b[1];
  const double z = a[2] * b[2];
  return {2.0 * (y + z),
          2.0 * (x + z),
          2.0 * (x + y),
          -(a[0] * b[1] + a[1] * b[0]),
          -(a[0] * b[2] + a[2] * b[0]),
          -(a[1] * b[2] + a[2] * b[1])};
}
inline Symmetric3 operator*(double a, const Symmetric3& s) noexcept {
  return {a * s[0], a * s[1], a * s[2], a * s[3], a * s[4], a * s[5]};
}

}  // namespace torsio
