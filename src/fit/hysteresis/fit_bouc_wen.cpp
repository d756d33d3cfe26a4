#include <algorithm>
#include <array>
#include <cmath>

#include "fit/common/fitted.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"
#include "fit/hysteresis/operator_data.hpp"

namespace torsio {
namespace {

/// What the search moves: the logarithm of z_max, n, and gamma / beta.
struct Shape {
  double largest;
  double exponent;
  double ratio;
};
Shape shape_of(std::span<const double> theta) { return {std::exp(theta[0]), theta[1], theta[2]}; }

constexpr double kMaxExponent = 10.0;
constexpr double kLeastRatio = -0.95;  ///< at -1 the force has no bound

/// Differences reach over the bounds of the search by a little.
bool is_allowed(const Shape& shape) {
  return shape.largest > 0.0 && shape.exponent >= 1.0 && shape.ratio > -1.0 && shape.ratio <= 1.0;
}

/// With a hysteresis of weight `hysteresis` for z / z_max and an elastic slope beside it.
BoucWenModel::Parameters parameters_of(const Shape& shape, double bias, double elastic,
                                       double hysteresis) {
  BoucWenModel::Parameters parameters;
  parameters.stiffness = elastic + hysteresis / shape.largest;
  if (parameters.stiffness == 0.0 || hysteresis == 0.0) {
    parameters.stiffness = elastic;
    parameters.elastic_share = 1.0;
  } else {
    parameters.elastic_share = elastic / parameters.stiffness;
  }
  const double sum = std::pow(shape.largest, -shape.exponent);
  parameters.beta = sum / (1.0 + shape.ratio);
  parameters.gamma = std::min(shape.ratio * parameters.beta, parameters.beta);
  parameters.exponent = shape.exponent;
  parameters.bias = bias;
  return parameters;
}

class BoucWenSearch {
 public:
  explicit BoucWenSearch(const OperatorData& data)
      : data_(data), columns_(data.rows(), 3 + data.inputs()), is_free_(columns_.columns, 1) {
    is_free_[2] = 0;
    for (std::size_t n = 0; n < data.rows(); ++n) {
      columns_(n, 0) = 1.0;
      for (std::size_t j = 0; j < data.inputs(); ++j) columns_(n, 3 + j) = data.others(n, j);
    }
  }

  /// @returns b, alpha k, the weight of z / z_max, then the slopes
  LinearSolution solve(const Shape& shape, std::span<double> residuals) {
    run(shape);
    return solve_linear(columns_, data_.target, is_free_, residuals);
  }

  /// What a given solution leaves, for the uncertainty of all parameters.
  void residuals_of(const Shape& shape, std::span<const double> coefficients,
                    std::span<double> residuals) {
    run(shape);
    for (std::size_t n = 0; n < data_.rows(); ++n) {
      residuals[n] = -data_.target[n];
      for (std::size_t j = 0; j < coefficients.size(); ++j)
        residuals[n] += columns_(n, j) * coefficients[j];
    }
  }

 private:
  /// Columns of x_0 and z / z_max.
  void run(const Shape& shape) {
    auto parameters = parameters_of(shape, 0.0, 0.0, 1.0);
    parameters.slopes = {0.0};
    BoucWenModel model(parameters);
    for (const Stretch& stretch : data_.stretches) {
      model.reset();
      for (std::size_t n = 0; n < stretch.x.size(); ++n) {
        model.step({&stretch.x[n], 1});
        if (stretch.row[n] == Stretch::kUnused) continue;
        columns_(stretch.row[n], 1) = stretch.x[n];
        columns_(stretch.row[n], 2) = model.state()[0];
      }
    }
  }

  const OperatorData& data_;
  Matrix columns_;
  std::vector<std::uint8_t> is_free_;
};

std::vector<FittedParameter> table_of(BoucWenSearch& search, const OperatorData& data,
                                      std::span<const double> theta,
                                      std::span<const double> coefficients,
                                      std::vector<std::string>& notes) {
  std::vector<double> all(theta.begin(), theta.end());
  all[0] = std::exp(all[0]);
  all.insert(all.end(), coefficients.begin(), coefficients.begin() + 3);
  std::vector<double> linear(coefficients.begin(), coefficients.end());
  const ResidualProblem problem{
      .residuals = data.rows(),
      .evaluate = [&](std::span<const double> at, std::span<double> residuals,
                      std::span<double> /*jacobian*/) {
        const Shape shape{at[0], at[1], at[2]};
        if (!is_allowed(shape)) return false;
        std::copy(at.begin() + 3, at.end(), linear.begin());
        search.residuals_of(shape, linear, residuals);
        return true;
      }};
  const ParameterUncertainty uncertainty = uncertainty_of(problem, all);
  std::vector<FittedParameter> table{{"z_max", data.x_unit, all[0]},
                                     {"n", "", all[1]},
                                     {"gamma/beta", "", all[2]},
                                     {"b", data.torque_unit, all[3]},
                                     {"alpha k", data.stiffness_unit, all[4]},
                                     {"(1 - alpha) k z_max", data.torque_unit, all[5]}};
  for (std::size_t i = 0; i < table.size(); ++i) table[i].std_error = uncertainty.std_error[i];
  note_null_directions(uncertainty, table, notes);
  return table;
}

}  // namespace

Fitted<BoucWenModel> fit_bouc_wen(const TrainingData& data, const BoucWenOptions& options,
                                  const Progress& progress) {
  const OperatorData runs =
      operator_data(data, options.rates, 0, kMaxResiduals / 4, 6 + data.input_count());
  constexpr double kSmallTurn = 2e-3;
  const OperatorData smooth_runs = without_small_turns(runs, kSmallTurn * runs.half_range);
  BoucWenSearch smooth_search(smooth_runs);
  BoucWenSearch search(runs);
  const auto problem_of = [&](BoucWenSearch& of) {
    return ResidualProblem{
        .residuals = runs.rows(),
        .evaluate = [&](std::span<const double> theta, std::span<double> residuals,
                        std::span<double> /*jacobian*/) {
          if (!is_allowed(shape_of(theta))) return false;
          of.solve(shape_of(theta), residuals);
          return true;
        }};
  };
  const double range = std::log(runs.half_range);
  const double highest = range + std::log(4.0);
  std::vector<std::vector<double>> starts;
  for (const double share : {0.03, 0.3})
    for (const double ratio : {0.8, -0.3}) starts.push_back({range + std::log(share), 1.5, ratio});
  const SearchOptions limits{.max_iterations = options.max_iterations,
                             .lower = {range + std::log(1e-4), 1.0, kLeastRatio},
                             .upper = {highest, kMaxExponent, 1.0},
                             .typical = {1.0, 1.0, 1.0},
                             .progress = progress};
  const SearchResult near =
      converged_search(problem_of(smooth_search), starts, limits, BoucWenModel::kFamily);
  const SearchResult found =
      converged_search(problem_of(search), {near.theta}, limits, BoucWenModel::kFamily);
  std::vector<double> residuals(runs.rows());
  const Shape shape = shape_of(found.theta);
  const LinearSolution linear = search.solve(shape, residuals);
  const std::vector<double>& c = linear.coefficients;
  // A line takes no small steps.
  const Shape scaled = c[2] == 0.0 ? Shape{runs.half_range, 1.0, 0.0} : shape;
  Fitted<BoucWenModel> fitted{parameters_of(scaled, c[0], c[1], c[2]), runs.notes};
  fitted.parameters.slopes.assign(c.begin() + 3, c.end());
  fitted.parameters.centre = runs.centre;
  fitted.parameters.half_range = runs.half_range;
  if (c[2] == 0.0) {
    fitted.notes.emplace_back(
        "no hysteresis lowers the error, what is left is a line: the data have none, or the first "
        "input and the target differ in sign");
    return fitted;
  }
  if (shape.exponent > 0.999 * kMaxExponent)
    fitted.notes.emplace_back("n is at its bound: the data do not determine how sharp the knee is");
  if (found.theta[0] > highest - 1e-3)
    fitted.notes.emplace_back("z_max is at its bound: the hysteresis never comes to its end");
  fitted.table = table_of(search, runs, found.theta, c, fitted.notes);
  return fitted;
}

}  // namespace torsio
