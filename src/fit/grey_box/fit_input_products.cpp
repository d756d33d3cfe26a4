#include "fit/grey_box/fit_input_products.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Eigen::Index;

/// Means and standard deviations of the inputs; of one that is constant, 0.
void standardise(InputProducts::Parameters& parameters, const TrainingData& data) {
  const std::size_t inputs = data.input_count();
  std::vector<double> sums(inputs, 0.0);
  double count = 0.0;
  for_each_usable(data, [&](Features features, double) {
    for (std::size_t j = 0; j < inputs; ++j) sums[j] += features[j];
    ++count;
  });
  std::vector<double> squares(inputs, 0.0);
  for (double& sum : sums) sum /= count;
  for_each_usable(data, [&](Features features, double) {
    for (std::size_t j = 0; j < inputs; ++j)
      squares[j] += (features[j] - sums[j]) * (features[j] - sums[j]);
  });
  parameters.centres = sums;
  parameters.scales.resize(inputs);
  for (std::size_t j = 0; j < inputs; ++j) {
    constexpr double kVaries = 1e-9;
    const double scale = std::sqrt(squares[j] / count);
    parameters.scales[j] = scale > kVaries * std::abs(sums[j]) ? scale : 0.0;
  }
}

/// Leaves at most `kMaxProductInputs`: those before `optional`, of which some must vary, and a spread of the others.
void select(InputProducts::Parameters& parameters, std::size_t optional) {
  const std::size_t first = parameters.scales.size() - optional;
  std::vector<std::size_t> others;
  std::size_t used = 0;
  for (const std::size_t i : parameters.used()) {
    if (i >= first) {
      others.push_back(i);
    } else if (++used > kMaxProductInputs) {
      parameters.scales[i] = 0.0;
    }
  }
  const std::size_t places = kMaxProductInputs - std::min(used, kMaxProductInputs);
  if (others.size() <= places) return;
  std::vector<double> kept(others.size(), 0.0);
  for (std::size_t k = 0; k < places; ++k) {
    const std::size_t at = k * others.size() / places;
    kept[at] = parameters.scales[others[at]];
  }
  for (std::size_t k = 0; k < others.size(); ++k) parameters.scales[others[k]] = kept[k];
}

}  // namespace

InputProducts::Parameters fit_input_products(const TrainingData& data, std::size_t degree,
                                             std::size_t optional) {
  InputProducts::Parameters parameters{
      .degree = degree, .centres = {}, .scales = {}, .coefficients = {}};
  standardise(parameters, data);
  select(parameters, optional);
  const std::vector<std::size_t> used = parameters.used();
  if (used.empty())
    throw Error({.problem = "products of inputs need an input that varies",
                 .found = "all inputs are constant in the training data"});
  const std::size_t count = InputProducts::count(used.size(), degree);
  const auto columns = static_cast<Index>(count);
  constexpr Index kBlock = 256;
  Eigen::MatrixXd block(columns, kBlock);
  Eigen::VectorXd targets(kBlock);
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd projection = Eigen::VectorXd::Zero(columns);
  Index rows = 0;
  double samples = 0.0;
  const auto add_block = [&] {
    if (rows == 0) return;
    product.selfadjointView<Eigen::Lower>().rankUpdate(block.leftCols(rows));
    projection.noalias() += block.leftCols(rows) * targets.head(rows);
    rows = 0;
  };
  std::vector<double> z(used.size());
  for_each_usable(data, [&](Features features, double target) {
    for (std::size_t i = 0; i < used.size(); ++i)
      z[i] = (features[used[i]] - parameters.centres[used[i]]) / parameters.scales[used[i]];
    InputProducts::terms(z, degree, {block.col(rows).data(), count});
    targets[rows++] = target;
    ++samples;
    if (rows == kBlock) add_block();
  });
  add_block();
  if (samples < static_cast<double>(count))
    throw Error({.problem = "too few training samples for products of inputs",
                 .expected = fmt::format("at least {}", count),
                 .found = fmt::format("{}", samples)});
  constexpr double kRidge = 0.01;
  product.diagonal().tail(columns - 1).array() += kRidge * samples;
  const Eigen::VectorXd solution = product.selfadjointView<Eigen::Lower>().llt().solve(projection);
  parameters.coefficients.assign(solution.begin(), solution.end());
  return parameters;
}

}  // namespace torsio
