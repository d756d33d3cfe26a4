#include "torsio/arm/flange_wrench.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/all_finite.hpp"
#include "torsio/arm/cartesian_impedance.hpp"

namespace torsio {
namespace {

constexpr double kWrenchLength_m = 0.5;  // makes rotations and translations comparable
constexpr double kWrenchRounding = 1e-12;

double length_of(std::size_t row) noexcept { return row < 3 ? kWrenchLength_m : 1.0; }

/// J D Jᵀ of the first `rows` rows, in units of `length_of`.
void square(const ArmDynamics::Jacobian& jacobian, std::span<const double> diagonal,
            std::size_t rows, std::span<double> product) noexcept {
  const std::size_t n = diagonal.size();
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t k = 0; k < rows; ++k) {
      double sum = 0.0;
      for (std::size_t j = 0; j < n; ++j)
        sum += jacobian[i * n + j] * diagonal[j] * jacobian[k * n + j];
      product[i * rows + k] = sum / (length_of(i) * length_of(k));
    }
}

/// The smallest motion of an axis that the axes before it do not have, over the largest motion of one.
double manipulability_of(const ArmDynamics::Jacobian& jacobian, std::size_t joints,
                         std::size_t rows) noexcept {
  ArmDynamics::PerJoint ones;
  ones.fill(1.0);
  std::array<double, 36> product;
  const auto all = std::span(product).first(rows * rows);
  square(jacobian, std::span(ones).first(joints), rows, all);
  double largest = 0.0;
  for (std::size_t i = 0; i < rows; ++i) largest = std::max(largest, product[i * (rows + 1)]);
  for (std::size_t i = 0; i < rows; ++i) product[i * (rows + 1)] += kWrenchRounding * largest;
  if (!factor_positive(all, rows)) return 0.0;
  double largest_inverse = 0.0;
  for (std::size_t i = 0; i < rows; ++i)
    largest_inverse = std::max(largest_inverse, product[i * (rows + 1)]);
  return std::sqrt(1.0 / (largest * largest_inverse));
}

}  // namespace

FlangeWrench flange_wrench(const ArmDynamics& dynamics, std::span<const double> angle_rad,
                           std::span<const double> external_Nm,
                           std::span<const double> std_dev_Nm) noexcept {
  const std::size_t n = dynamics.size();
  FlangeWrench wrench;
  ArmDynamics::Jacobian jacobian;
  dynamics.jacobian(angle_rad, jacobian);
  ArmDynamics::PerJoint weight;
  for (std::size_t j = 0; j < n; ++j) weight[j] = 1.0 / (std_dev_Nm[j] * std_dev_Nm[j]);
  if (!all_finite(std::span(weight).first(n)) || !all_finite(external_Nm.first(n)) ||
      !all_finite(std::span(jacobian).first(6 * n)))
    return wrench;
  for (const std::size_t rows : {std::size_t{6}, std::size_t{3}}) {
    const double manipulability = n < rows ? 0.0 : manipulability_of(jacobian, n, rows);
    if (rows == 6) wrench.manipulability = manipulability;
    if (manipulability < CartesianImpedance::kSingular) continue;
    std::array<double, 36> information;
    const auto all = std::span(information).first(rows * rows);
    square(jacobian, std::span(weight).first(n), rows, all);
    if (!factor_positive(all, rows)) continue;
    std::array<double, 6> right = {};
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < n; ++j)
        right[i] += jacobian[i * n + j] * weight[j] * external_Nm[j] / length_of(i);
    solve_factored(all, std::span(right).first(rows));
    for (std::size_t i = 0; i < rows; ++i) {
      std::array<double, 6> unit = {};
      unit[i] = 1.0;
      solve_factored(all, std::span(unit).first(rows));
      wrench.value[i] = right[i] / length_of(i);
      wrench.std_dev[i] = std::sqrt(unit[i]) / length_of(i);
    }
    wrench.manipulability = manipulability;
    wrench.determined =
        rows == 6 ? FlangeWrench::Determined::both : FlangeWrench::Determined::force;
    return wrench;
  }
  return wrench;
}

}  // namespace torsio
