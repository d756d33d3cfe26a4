#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/design/coupling/lobe.hpp"

namespace torsio::design {
namespace {

void check_density(const MeshDensity& d) {
  const bool even = d.radial % 2 == 0 && d.across % 2 == 0;
  if (d.radial < 2 || d.across < 2 || d.radial > 400 || d.across > 400 || !even)
    throw UsageError({.place = "mesh of the lobe",
                      .expected = "even numbers of divisions from 2 to 400",
                      .found = fmt::format("{} x {}", d.radial, d.across),
                      .advice = "choose for example 20 x 14"});
  if (!(d.grading >= 1.0 && d.grading <= 3.0))
    throw UsageError({.place = "mesh of the lobe",
                      .expected = "a grading from 1 to 3",
                      .found = fmt::format("{}", d.grading),
                      .advice = "1 means elements of equal size"});
}

/// Position in 0..1 with smaller steps at both ends.
double graded(double s, double grading) {
  const double t = 2.0 * s - 1.0;
  return 0.5 * (1.0 + std::copysign(std::pow(std::abs(t), 1.0 / grading), t));
}

/// How far the tapered outer face lies below the outer radius in a direction: the face is the arc
/// through both outer ends of the flanks and the point (outer radius - taper, 0).
double recess_mm(const LobeShape& shape, double end_rad, double direction_rad) {
  if (shape.taper_mm == 0.0) return 0.0;
  const double middle_mm = shape.outer_radius_mm - shape.taper_mm;
  const double x_mm = shape.outer_radius_mm * std::cos(end_rad);
  const double y_mm = shape.outer_radius_mm * std::sin(end_rad);
  if (std::abs(x_mm - middle_mm) < 1e-9 * shape.outer_radius_mm)
    return shape.outer_radius_mm - middle_mm / std::cos(direction_rad);
  const double centre_mm =
      (x_mm * x_mm + y_mm * y_mm - middle_mm * middle_mm) / (2.0 * (x_mm - middle_mm));
  const double sine = centre_mm * std::sin(direction_rad);
  const double arc_mm = middle_mm - centre_mm;
  const double root_mm = std::sqrt(arc_mm * arc_mm - sine * sine);
  const double face_mm = centre_mm * std::cos(direction_rad) + std::copysign(root_mm, arc_mm);
  return shape.outer_radius_mm - face_mm;
}

MeshNode mapped(const LobeShape& shape, double u, double v, double outer_end_rad) {
  const double radius_mm = std::lerp(shape.root_radius_mm, shape.outer_radius_mm, u);
  const double direction_rad = v * flank_angle_rad(shape, radius_mm);
  const double face_mm = radius_mm - u * recess_mm(shape, outer_end_rad, v * outer_end_rad);
  return {face_mm * std::cos(direction_rad), face_mm * std::sin(direction_rad)};
}

double jacobian_mm2(const LobeMesh& mesh, const std::array<int, 6>& triangle, double r, double s) {
  const double t = 1.0 - r - s;
  const std::array<double, 6> by_r = {1 - 4 * t, 4 * r - 1, 0, 4 * (t - r), 4 * s, -4 * s};
  const std::array<double, 6> by_s = {1 - 4 * t, 0, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)};
  double xr = 0.0;
  double xs = 0.0;
  double yr = 0.0;
  double ys = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const MeshNode& node = mesh.nodes[static_cast<std::size_t>(triangle[i])];
    xr += by_r[i] * node.x_mm;
    xs += by_s[i] * node.x_mm;
    yr += by_r[i] * node.y_mm;
    ys += by_s[i] * node.y_mm;
  }
  return xr * ys - xs * yr;
}

/// Two triangles of six nodes of a quadrilateral whose nodes are at (row, column), both even.
template <class Number>
void add_pair(LobeMesh& mesh, const Number& number, int i, int j, bool is_rising) {
  const int a = number(i, j);
  const int b = number(i + 2, j);
  const int c = number(i + 2, j + 2);
  const int d = number(i, j + 2);
  const int ab = number(i + 1, j);
  const int bc = number(i + 2, j + 1);
  const int cd = number(i + 1, j + 2);
  const int da = number(i, j + 1);
  const int middle = number(i + 1, j + 1);
  if (is_rising) {
    mesh.triangles.push_back({a, b, c, ab, bc, middle});
    mesh.triangles.push_back({a, c, d, middle, cd, da});
  } else {
    mesh.triangles.push_back({a, b, d, ab, middle, da});
    mesh.triangles.push_back({b, c, d, bc, cd, middle});
  }
}

/// The ring below the lobe and below both halves of jaws beside it: radial lines through the nodes of
/// the lobe's root. The lobe's nodes are the first ones of the mesh, `columns` + 1 at its root.
void add_ring(LobeMesh& mesh, const LobeShape& shape, const MeshDensity& density, int columns) {
  constexpr double kPitch_rad = std::numbers::pi / 6.0;
  const int rows = 2 * std::max(2, density.radial / 2);
  const int side = 2 * std::max(2, density.across / 2);
  const double end_rad = flank_angle_rad(shape, shape.root_radius_mm);
  const int first = static_cast<int>(mesh.nodes.size());
  const int all = columns + 2 * side;
  const auto is_shared = [&](int i, int j) {
    return i == rows && j >= side && j <= side + columns;
  };
  const auto angle_rad = [&](int j) {
    if (j < side) return -std::lerp(kPitch_rad, end_rad, static_cast<double>(j) / side);
    if (j > side + columns)
      return std::lerp(end_rad, kPitch_rad, static_cast<double>(j - side - columns) / side);
    const MeshNode& root = mesh.nodes[static_cast<std::size_t>(j - side)];
    return std::atan2(root.y_mm, root.x_mm);
  };
  const auto number = [&](int i, int j) {
    if (is_shared(i, j)) return j - side;
    // The last row lacks the shared nodes.
    const int skipped = i == rows && j > side + columns ? columns + 1 : 0;
    return first + i * (all + 1) + j - skipped;
  };
  std::vector<double> angles(static_cast<std::size_t>(all) + 1);
  for (int j = 0; j <= all; ++j) angles[static_cast<std::size_t>(j)] = angle_rad(j);
  for (int i = 0; i <= rows; ++i) {
    const double radius_mm =
        std::lerp(shape.ring_radius_mm, shape.root_radius_mm, static_cast<double>(i) / rows);
    for (int j = 0; j <= all; ++j) {
      if (is_shared(i, j)) continue;
      const double angle = angles[static_cast<std::size_t>(j)];
      mesh.nodes.push_back({radius_mm * std::cos(angle), radius_mm * std::sin(angle)});
    }
  }
  for (int i = 0; i < rows; i += 2)
    for (int j = 0; j < all; j += 2) add_pair(mesh, number, i, j, j < all / 2);
  for (int j = 0; j < side; ++j) {
    mesh.lower_flank.push_back(number(rows, j));
    mesh.upper_flank.push_back(number(rows, all - j));
  }
  for (int i = 0; i < rows; ++i) {
    mesh.lower_flank.push_back(number(i, 0));
    mesh.upper_flank.push_back(number(i, all));
  }
  mesh.bond_ends.push_back(number(0, 0));
  mesh.bond_ends.push_back(number(0, all));
}

}  // namespace

LobeMesh mesh_lobe(const LobeShape& shape, const MeshDensity& density) {
  check_density(density);
  check_lobe(shape);
  const double outer_end_rad = flank_angle_rad(shape, shape.outer_radius_mm);
  const int rows = 2 * density.radial;
  const int columns = 2 * density.across;
  const auto number = [columns](int i, int j) { return i * (columns + 1) + j; };

  LobeMesh mesh;
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j <= columns; ++j)
      mesh.nodes.push_back(mapped(
          shape, graded(static_cast<double>(i) / rows, density.grading),
          2.0 * graded(static_cast<double>(j) / columns, density.grading) - 1.0, outer_end_rad));
  for (int i = 0; i < rows; i += 2)
    for (int j = 0; j < columns; j += 2)
      add_pair(mesh, number, i, j, (i < density.radial) == (j < density.across));
  for (int i = 0; i <= rows; ++i) {
    mesh.lower_flank.push_back(number(i, 0));
    mesh.upper_flank.push_back(number(i, columns));
  }
  mesh.bond_ends = {number(0, 0), number(0, columns), number(rows, 0), number(rows, columns)};
  if (shape.ring_radius_mm > 0.0) add_ring(mesh, shape, density, columns);
  return mesh;
}

double smallest_jacobian_mm2(const LobeMesh& mesh) {
  constexpr std::array<std::array<double, 2>, 6> kNodes = {
      {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}}};
  double smallest = HUGE_VAL;
  for (const auto& triangle : mesh.triangles)
    for (const auto& [r, s] : kNodes)
      smallest = std::min(smallest, jacobian_mm2(mesh, triangle, r, s));
  return smallest;
}

double mesh_area_mm2(const LobeMesh& mesh) {
  double area_mm2 = 0.0;
  for (const auto& triangle : mesh.triangles)  // the determinant is quadratic: middles suffice
    area_mm2 += (jacobian_mm2(mesh, triangle, 0.5, 0.0) + jacobian_mm2(mesh, triangle, 0.5, 0.5) +
                 jacobian_mm2(mesh, triangle, 0.0, 0.5)) /
                6.0;
  return area_mm2;
}

}  // namespace torsio::design
