#include "torsio/control/design/linear_system.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "control/design/loop_design.hpp"
#include "core/checks.hpp"
#include "core/matrix_functions.hpp"
#include "core/row_major_map.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "linear system";

using Eigen::Index;

Matrix table(const RowMajor& matrix) {
  Matrix result(static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols()));
  std::copy(matrix.data(), matrix.data() + matrix.size(), result.values.begin());
  return result;
}

RowMajor joined(const RowMajor& top_left, const RowMajor& top_right, const RowMajor& bottom_left,
                const RowMajor& bottom_right) {
  RowMajor all(top_left.rows() + bottom_left.rows(), top_left.cols() + top_right.cols());
  all << top_left, top_right, bottom_left, bottom_right;
  return all;
}

RowMajor zeros(Index rows, Index columns) { return RowMajor::Zero(rows, columns); }

/// One state with one input and one output.
LinearSystem first_order(double a, double b, double c, double d, double sample_rate_Hz) {
  const auto number = [](double value) { return Matrix(1, 1, value); };
  return LinearSystem({number(a), number(b), number(c), number(d)}, sample_rate_Hz);
}

/// b0 (1 + 2 z⁻¹ + z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²) in controller form.
LinearSystem second_order(double b0, double a1, double a2, double sample_rate_Hz) {
  LinearSystem::Matrices matrices{Matrix(2, 2), Matrix(2, 1), Matrix(1, 2), Matrix(1, 1, b0)};
  matrices.a.values = {-a1, -a2, 1.0, 0.0};
  matrices.b.values = {1.0, 0.0};
  matrices.c.values = {b0 * (2.0 - a1), b0 * (1.0 - a2)};
  return {std::move(matrices), sample_rate_Hz};
}

void require_fit(bool fits, const char* what, std::size_t expected, std::size_t found) {
  if (fits) return;
  throw Error({.place = kPlace,
               .problem = fmt::format("{} do not fit", what),
               .expected = fmt::format("{}", expected),
               .found = fmt::format("{}", found)});
}

void require_one_rate(const LinearSystem& one, const LinearSystem& other) {
  require_parameter(one.sample_rate_Hz() == other.sample_rate_Hz(), kPlace,
                    fmt::format("systems of one sample rate, {} Hz", one.sample_rate_Hz()),
                    other.sample_rate_Hz());
}

}  // namespace

LinearSystem::LinearSystem(Matrices matrices, double sample_rate_Hz)
    : matrices_(std::move(matrices)), sample_rate_Hz_(sample_rate_Hz) {
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  const auto& [a, b, c, d] = matrices_;
  require_fit(a.columns == a.rows, "columns of A", a.rows, a.columns);
  require_fit(b.rows == a.rows, "rows of B", a.rows, b.rows);
  require_fit(c.columns == a.rows, "columns of C", a.rows, c.columns);
  require_fit(b.columns == d.columns, "inputs of B", d.columns, b.columns);
  require_fit(c.rows == d.rows, "outputs of C", d.rows, c.rows);
  for (const Matrix* const part : {&a, &b, &c, &d}) {
    for (const double value : part->values)
      require_parameter(std::isfinite(value), kPlace, "finite numbers", value);
  }
}

// exp of [A B; 0 0] T is [A_d B_d; 0 1].
LinearSystem LinearSystem::held(const Matrices& continuous, double sample_rate_Hz) {
  const LinearSystem checked(continuous, sample_rate_Hz);
  const auto states = static_cast<Index>(checked.order());
  const auto inputs = static_cast<Index>(checked.input_count());
  const RowMajor exponent = joined(row_major_map(continuous.a), row_major_map(continuous.b),
                                   zeros(inputs, states), zeros(inputs, inputs)) /
                            sample_rate_Hz;
  const RowMajor both = matrix_exponential(exponent);
  return LinearSystem({table(both.topLeftCorner(states, states)),
                       table(both.topRightCorner(states, inputs)), continuous.c, continuous.d},
                      sample_rate_Hz);
}

LinearSystem LinearSystem::gain(double gain, double sample_rate_Hz) {
  return LinearSystem({Matrix(0, 0), Matrix(0, 1), Matrix(1, 0), Matrix(1, 1, gain)},
                      sample_rate_Hz);
}

LinearSystem LinearSystem::delay(double sample_rate_Hz) {
  return first_order(0.0, 1.0, 1.0, 0.0, sample_rate_Hz);
}

LinearSystem LinearSystem::integrator(double sample_rate_Hz) {
  return first_order(1.0, 1.0 / sample_rate_Hz, 1.0, 0.0, sample_rate_Hz);
}

LinearSystem LinearSystem::difference(double sample_rate_Hz) {
  return first_order(0.0, 1.0, -sample_rate_Hz, sample_rate_Hz, sample_rate_Hz);
}

// The bilinear transform of 1 / ((s/w)^2 + sqrt(2) s/w + 1), prewarped.
LinearSystem LinearSystem::lowpass(double cutoff_Hz, double sample_rate_Hz) {
  static_cast<void>(Lowpass(cutoff_Hz, sample_rate_Hz));  // refuses what it cannot be
  const double g = std::tan(std::numbers::pi * cutoff_Hz / sample_rate_Hz);
  const double whole = 1.0 + g * (g + std::numbers::sqrt2);
  return second_order(g * g / whole, 2.0 * (g * g - 1.0) / whole,
                      (1.0 + g * (g - std::numbers::sqrt2)) / whole, sample_rate_Hz);
}

// The delays 0 to N − 1 have the mean (N − 1) / 2 and the variance (N² − 1) / 12, as 1 / (1 + f s + g s²) has with these
// factors; by the bilinear transform.
LinearSystem slow_hold(std::size_t ticks, double sample_rate_Hz) {
  if (ticks <= 1) return LinearSystem::gain(1.0, sample_rate_Hz);
  const double last = static_cast<double>(ticks) - 1.0;
  const double first_order = last;                   // 2 f
  const double squares = last * (last - 1.0) / 3.0;  // 4 g
  const double whole = 1.0 + first_order + squares;
  return second_order(1.0 / whole, 2.0 * (1.0 - squares) / whole,
                      (1.0 - first_order + squares) / whole, sample_rate_Hz);
}

// [A B; 0 1] to the power of the ticks.
LinearSystem::Matrices over_ticks(const LinearSystem& system, std::size_t ticks) {
  const auto& [a, b, c, d] = system.matrices();
  const auto states = static_cast<Index>(system.order());
  const auto inputs = static_cast<Index>(system.input_count());
  RowMajor power = joined(row_major_map(a), row_major_map(b), zeros(inputs, states),
                          RowMajor::Identity(inputs, inputs));
  RowMajor all = RowMajor::Identity(states + inputs, states + inputs);
  for (std::size_t left = ticks; left > 0; left /= 2) {
    if (left % 2 == 1) all = all * power;
    if (left > 1) power = power * power;
  }
  return {table(all.topLeftCorner(states, states)), table(all.topRightCorner(states, inputs)), c,
          d};
}

std::complex<double> LinearSystem::response(double frequency_rad_s, std::size_t output,
                                            std::size_t input) const {
  const auto& [a, b, c, d] = matrices_;
  require_fit(output < output_count(), "outputs asked for", output_count(), output);
  require_fit(input < input_count(), "inputs asked for", input_count(), input);
  const double direct = d(output, input);
  if (order() == 0) return direct;
  const std::complex<double> z = std::polar(1.0, frequency_rad_s / sample_rate_Hz_);
  Eigen::MatrixXcd resolvent = -row_major_map(a).cast<std::complex<double>>();
  resolvent.diagonal().array() += z;
  const Eigen::VectorXcd states = resolvent.partialPivLu().solve(
      row_major_map(b).col(static_cast<Index>(input)).cast<std::complex<double>>());
  return (row_major_map(c).row(static_cast<Index>(output)).cast<std::complex<double>>() *
          states)(0) +
         direct;
}

double LinearSystem::spectral_radius() const {
  if (order() == 0) return 0.0;
  return eigenvalues(row_major_map(matrices_.a)).cwiseAbs().maxCoeff();
}

LinearSystem LinearSystem::closed() const {
  const auto& [a, b, c, d] = matrices_;
  require_fit(input_count() == output_count(), "inputs of a closed loop", output_count(),
              input_count());
  const auto size = static_cast<Index>(d.rows);
  const Eigen::FullPivLU<RowMajor> direct(RowMajor::Identity(size, size) + row_major_map(d));
  if (!direct.isInvertible())
    throw Error({.place = kPlace, .problem = "the feedback around a direct path has no solution"});
  const RowMajor inverse = direct.inverse();
  const RowMajor input = row_major_map(b) * inverse;
  const RowMajor output = inverse * row_major_map(c);
  return LinearSystem({table(row_major_map(a) - input * row_major_map(c)), table(input),
                       table(output), table(inverse * row_major_map(d))},
                      sample_rate_Hz_);
}

LinearSystem operator*(const LinearSystem& after, const LinearSystem& before) {
  require_one_rate(after, before);
  require_fit(after.input_count() == before.output_count(), "outputs before inputs",
              after.input_count(), before.output_count());
  const auto& [a2, b2, c2, d2] = after.matrices();
  const auto& [a1, b1, c1, d1] = before.matrices();
  const auto first = static_cast<Index>(before.order());
  const auto second = static_cast<Index>(after.order());
  RowMajor b(first + second, static_cast<Index>(before.input_count()));
  b << row_major_map(b1), RowMajor(row_major_map(b2) * row_major_map(d1));
  RowMajor c(static_cast<Index>(after.output_count()), first + second);
  c << RowMajor(row_major_map(d2) * row_major_map(c1)), row_major_map(c2);
  return LinearSystem({table(joined(row_major_map(a1), zeros(first, second),
                                    row_major_map(b2) * row_major_map(c1), row_major_map(a2))),
                       table(b), table(c), table(row_major_map(d2) * row_major_map(d1))},
                      after.sample_rate_Hz());
}

LinearSystem side_by_side(const LinearSystem& one, const LinearSystem& other) {
  require_one_rate(one, other);
  require_fit(one.output_count() == other.output_count(), "outputs", one.output_count(),
              other.output_count());
  const auto& [a1, b1, c1, d1] = one.matrices();
  const auto& [a2, b2, c2, d2] = other.matrices();
  const auto block = [](const Matrix& top_left, const Matrix& bottom_right) {
    return joined(
        row_major_map(top_left),
        zeros(static_cast<Index>(top_left.rows), static_cast<Index>(bottom_right.columns)),
        zeros(static_cast<Index>(bottom_right.rows), static_cast<Index>(top_left.columns)),
        row_major_map(bottom_right));
  };
  RowMajor c(static_cast<Index>(c1.rows), static_cast<Index>(c1.columns + c2.columns));
  c << row_major_map(c1), row_major_map(c2);
  RowMajor d(static_cast<Index>(d1.rows), static_cast<Index>(d1.columns + d2.columns));
  d << row_major_map(d1), row_major_map(d2);
  return LinearSystem({table(block(a1, a2)), table(block(b1, b2)), table(c), table(d)},
                      one.sample_rate_Hz());
}

LinearSystem operator+(const LinearSystem& one, const LinearSystem& other) {
  require_fit(one.input_count() == other.input_count(), "inputs", one.input_count(),
              other.input_count());
  const LinearSystem both = side_by_side(one, other);
  const auto inputs = static_cast<Index>(one.input_count());
  const auto& [a, b, c, d] = both.matrices();
  return LinearSystem(
      {a, table(row_major_map(b).leftCols(inputs) + row_major_map(b).rightCols(inputs)), c,
       table(row_major_map(d).leftCols(inputs) + row_major_map(d).rightCols(inputs))},
      one.sample_rate_Hz());
}

}  // namespace torsio
