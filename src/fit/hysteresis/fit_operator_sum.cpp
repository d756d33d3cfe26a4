#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fit/common/fitted.hpp"
#include "fit/common/regression.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"
#include "fit/hysteresis/operator_data.hpp"
#include "numerics/nnls.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::vector<double> geometric_thresholds(const OperatorData& data, std::size_t count) {
  constexpr double kSmallest = 1.0 / 128.0;
  std::vector<double> thresholds(count, data.half_range);
  for (std::size_t i = 0; i + 1 < count; ++i)
    thresholds[i] *=
        std::pow(kSmallest, static_cast<double>(count - 1 - i) / static_cast<double>(count - 1));
  return thresholds;
}

std::vector<double> quantile_thresholds(const OperatorData& data, std::size_t count) {
  std::vector<double> distances;
  for (const Stretch& stretch : data.stretches)
    for (const double x : stretch.x) distances.push_back(std::abs(x - data.centre));
  std::ranges::sort(distances);
  std::vector<double> thresholds;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double threshold =
        distances[static_cast<std::size_t>(share * static_cast<double>(distances.size() - 1))];
    // An input that is constant most of the time has many equal quantiles.
    if (threshold > 0.0 && (thresholds.empty() || threshold > thresholds.back()))
      thresholds.push_back(threshold);
  }
  if (thresholds.empty()) thresholds.push_back(data.half_range);
  return thresholds;
}

/// The values of the operators at the rows of the data, times `sign`, from column `first` on.
template <class Operator>
void add_operators(Design& design, std::size_t first, const OperatorData& data,
                   const std::vector<double>& thresholds, double sign) {
  SlipBank stops(thresholds, Operator::kFamily);
  for (const Stretch& stretch : data.stretches) {
    stops.reset();
    Increment increment;
    for (std::size_t n = 0; n < stretch.x.size(); ++n) {
      stops.move(increment.step(stretch.x[n]));
      if (stretch.row[n] == Stretch::kUnused) continue;
      const auto row = design.columns.row(stretch.row[n]);
      for (std::size_t i = 0; i < thresholds.size(); ++i)
        row[first + i] = sign * Operator::of(stretch.x[n], stops.forces()[i]);
    }
  }
}

template <class Operator>
Design operator_design(const TrainingData& data, const OperatorData& runs, const Table& table,
                       const Groups& groups, const std::vector<double>& thresholds, bool rates,
                       double sign) {
  const std::size_t first = 1 + data.input_count();
  const std::size_t columns = first + thresholds.size();
  Design design{Matrix(table.features.rows, columns), table.target,
                std::vector<std::string>(columns)};
  design.terms[0] = "the bias";
  add_slopes(design, 1, data, table.features, groups, rates);
  design.terms[1] = "input " + data.inputs[0].expression;
  for (std::size_t n = 0; n < table.features.rows; ++n) {
    design.columns(n, 0) = 1.0;
    design.columns(n, 1) = table.features(n, 0);
  }
  for (std::size_t i = 0; i < thresholds.size(); ++i)
    design.terms[first + i] = fmt::format("the operator of threshold {:.3g}", thresholds[i]);
  add_operators<Operator>(design, first, runs, thresholds, sign);
  return design;
}

std::vector<FittedParameter> table_of(const OperatorData& data, const Design& design,
                                      const std::vector<double>& thresholds,
                                      const std::vector<double>& coefficients) {
  const std::vector<double> errors =
      standard_errors(normal_equations(design.columns, design.target), coefficients);
  std::vector<FittedParameter> table;
  const auto add = [&](std::string name, const std::string& unit, std::size_t column) {
    if (coefficients[column] != 0.0)
      table.push_back({std::move(name), unit, coefficients[column], errors[column]});
  };
  add("b", data.torque_unit, 0);
  add("k0", data.stiffness_unit, 1);
  const std::size_t first = coefficients.size() - thresholds.size();
  for (std::size_t i = 0; i < thresholds.size(); ++i)
    add(fmt::format("c{} (threshold {:.3g} {})", i + 1, thresholds[i], data.x_unit),
        data.stiffness_unit, first + i);
  return table;
}

template <class Operator, class Own>
Fitted<OperatorSum<Operator>> fit(const TrainingData& data, const Own& options, bool is_passive) {
  const OperatorData runs =
      operator_data(data, options.rates, 0, std::numeric_limits<std::size_t>::max() / 2, 1);
  Fitted<OperatorSum<Operator>> fitted;
  auto& parameters = fitted.parameters;
  constexpr bool kPlay = std::is_same_v<Operator, PlayOperator>;
  parameters.thresholds = kPlay ? quantile_thresholds(runs, options.thresholds)
                                : geometric_thresholds(runs, options.thresholds);
  const Table table = usable_table(data);
  const Groups groups = groups_by(options.schedule, data, table.features);
  // Friction is a stop of positive weight, hence a play of negative weight.
  const double sign = kPlay ? -1.0 : 1.0;
  Design design = operator_design<Operator>(data, runs, table, groups, parameters.thresholds,
                                            options.rates, sign);
  const std::size_t first = design.terms.size() - parameters.thresholds.size();
  std::vector<std::uint8_t> is_free(design.terms.size(), 1);
  if (is_passive) std::fill(is_free.begin() + static_cast<std::ptrdiff_t>(first), is_free.end(), 0);
  DesignFit fit = fit_design(design, groups, is_free);
  fitted.notes = std::move(fit.notes);
  if (!options.rates)
    note_on_rates(fitted.notes, design, groups, data, table.features,
                  OperatorSum<Operator>::kFamily, is_free);
  Matrix& values = fit.coefficients.values;
  if (values.rows == 1) {
    fitted.table = table_of(runs, design, parameters.thresholds, values.values);
    for (FittedParameter& each : fitted.table)
      if (each.name.starts_with('c')) each.value *= sign;
  }
  bool has_hysteresis = false;
  for (std::size_t k = 0; k < values.rows; ++k)
    for (std::size_t j = first; j < values.columns; ++j) {
      has_hysteresis = has_hysteresis || values(k, j) != 0.0;
      values(k, j) *= sign;
    }
  if (!has_hysteresis)
    fitted.notes.push_back(
        "no operator lowers the error, what is left is a line: the data have no such hysteresis, "
        "or the first input and the target differ in sign");
  parameters.coefficients = std::move(fit.coefficients);
  return fitted;
}

}  // namespace

Fitted<MaxwellSlipModel> fit_maxwell_slip(const TrainingData& data,
                                          const MaxwellSlipOptions& options) {
  return fit<StopOperator>(data, options, true);
}

Fitted<PrandtlIshlinskii> fit_prandtl_ishlinskii(const TrainingData& data,
                                                 const PrandtlIshlinskiiOptions& options) {
  return fit<PlayOperator>(data, options, options.passive);
}

}  // namespace torsio
