#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "model/hysteresis/slip_bank.hpp"
#include "numerics/residual_search.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// A record as an operator meets it: samples without features left out and, where no rate is heard,
/// unused ones between two turns.
struct Stretch {
  static constexpr std::size_t kUnused = static_cast<std::size_t>(-1);
  std::vector<double> x;         ///< the first input
  std::vector<double> rate;      ///< the rate input, or empty
  std::vector<std::size_t> row;  ///< row of the target, or `kUnused`
};

/// What fits of operators share.
struct OperatorData {
  std::vector<Stretch> stretches;
  std::vector<double> target;
  Matrix others;                   ///< rows x inputs; 0 where an input has no slope
  std::vector<std::string> terms;  ///< names of `others`; empty: no slope
  double centre = 0.0;             ///< mid-range of the first input over all samples
  double half_range = 0.0;
  std::vector<std::string> notes;
  std::string torque_unit;     ///< "Nm"
  std::string stiffness_unit;  ///< "Nm/rad"
  std::string x_unit;          ///< "rad"

  [[nodiscard]] std::size_t rows() const noexcept { return target.size(); }
  [[nodiscard]] std::size_t inputs() const noexcept { return others.columns; }
};

/// @param rate_feature which input is the rate; that of the first input: none
/// @param max_rows usable samples beyond these are thinned out evenly
/// @throws Error if the first input is constant, or fewer than five rows come on each of
/// `parameters`.
[[nodiscard]] OperatorData operator_data(const TrainingData& data, bool rates,
                                         std::size_t rate_feature, std::size_t max_rows,
                                         std::size_t parameters);

/// The same rows, and on the way between them only turns by more than `dead_band`: for the long part of a
/// search, since an encoder's noise is thousands of turns that move next to nothing.
[[nodiscard]] OperatorData without_small_turns(OperatorData data, double dead_band);

/// Coefficients of columns that are linear in them, and what they leave.
struct LinearSolution {
  std::vector<double> coefficients;
  std::vector<std::size_t> dropped;
};
[[nodiscard]] LinearSolution solve_linear(const Matrix& columns, const std::vector<double>& target,
                                          const std::vector<std::uint8_t>& is_free,
                                          std::span<double> residuals);

/// A few iterations from each of several starts, then the best of them to its end.
/// @throws Error if that does not converge in `options.max_iterations`.
[[nodiscard]] SearchResult converged_search(const ResidualProblem& problem,
                                            const std::vector<std::vector<double>>& starts,
                                            SearchOptions options, std::string_view family);

/// Notes on parameters that the data do not determine.
void note_null_directions(const ParameterUncertainty& uncertainty,
                          const std::vector<FittedParameter>& table,
                          std::vector<std::string>& notes);

/// B_j(z) = C(d, j) ((1 + z) / 2)^j ((1 - z) / 2)^(d - j), j = 0 .. d: a sum with weights >= 0 is
/// nowhere below 0 in -1..1.
void bernstein(double z, std::span<double> values);
/// The coefficients of 1, z, .. z^d of that sum.
[[nodiscard]] std::vector<double> powers_of_bernstein(std::span<const double> weights);
void powers(double z, std::span<double> values);

}  // namespace torsio
