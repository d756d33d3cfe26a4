#include "fit/linear/fit_linear.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/hyperbolic_tangent.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/regression.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/linear/named_coefficients.hpp"
#include "numerics/golden_section.hpp"
#include "numerics/least_squares.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr int kGridPoints = 33;

/// Bias and slopes, and room for `extra` columns after them.
Design affine_design(const TrainingData& data, Table& table, const Groups& groups, bool rates,
                     std::size_t extra) {
  const std::size_t columns = 1 + data.input_count() + extra;
  Design design{Matrix(table.features.rows, columns), std::move(table.target),
                std::vector<std::string>(columns)};
  design.terms[0] = "the bias";
  for (std::size_t n = 0; n < table.features.rows; ++n) design.columns(n, 0) = 1.0;
  add_slopes(design, 1, data, table.features, groups, rates);
  return design;
}

/// What is left of the sum of squares of each group once the bias, the slopes and a friction term
/// with scale v are fitted, up to a constant.
class FrictionSearch {
 public:
  FrictionSearch(const Design& design, const Groups& groups, std::span<const double> rate) {
    for (const auto& samples : groups.samples) {
      Group group{.basis = orthonormal_basis(rows_of(design.columns, samples)),
                  .target = rows_of(design.target, samples),
                  .rate = {}};
      for (const std::size_t n : samples) group.rate.push_back(rate[n]);
      groups_.push_back(std::move(group));
    }
  }

  /// The scale between `lowest` and `highest` that leaves least.
  [[nodiscard]] double best_scale(double lowest, double highest) const {
    const double step = std::log(highest / lowest) / (kGridPoints - 1);
    const auto loss_at = [&](double position) { return -gain(lowest * std::exp(position * step)); };
    int best = 0;
    double least = 1.0;
    for (int i = 0; i < kGridPoints; ++i) {
      const double here = loss_at(i);
      if (here < least) {
        best = i;
        least = here;
      }
    }
    constexpr double kTolerance = 1e-6;  // share of a step of the grid
    return lowest *
           std::exp(step * golden_section(loss_at, std::max(best - 1, 0),
                                          std::min(best + 1, kGridPoints - 1), kTolerance));
  }

 private:
  struct Group {
    Matrix basis;
    std::vector<double> target;
    std::vector<double> rate;
  };

  /// (f . y)^2 / f . f for the part f of the friction column that the basis does not hold.
  [[nodiscard]] static double gain(const Group& group, double scale) {
    std::vector<double> friction(group.rate.size());
    std::ranges::transform(group.rate, friction.begin(), [scale](double rate) {
      return detail::hyperbolic_tangent(rate / scale);
    });
    std::vector<double> inside(group.basis.columns, 0.0);
    double length = 0.0;
    for (std::size_t n = 0; n < friction.size(); ++n) {
      length += friction[n] * friction[n];
      for (std::size_t j = 0; j < inside.size(); ++j) inside[j] += group.basis(n, j) * friction[n];
    }
    double along = 0.0;
    double square = 0.0;
    for (std::size_t n = 0; n < friction.size(); ++n) {
      double left = friction[n];
      for (std::size_t j = 0; j < inside.size(); ++j) left -= group.basis(n, j) * inside[j];
      along += left * group.target[n];
      square += left * left;
    }
    return square > 1e-12 * length ? along * along / square : 0.0;
  }

  [[nodiscard]] double gain(double scale) const {
    double sum = 0.0;
    for (const Group& group : groups_) sum += gain(group, scale);
    return sum;
  }

  std::vector<Group> groups_;
};

double found_scale(const Design& design, const Groups& groups, std::span<const double> rate,
                   std::vector<std::string>& notes) {
  double largest = 0.0;
  double square_sum = 0.0;
  for (const double r : rate) {
    largest = std::max(largest, std::abs(r));
    square_sum += r * r;
  }
  if (!(largest > 0.0)) throw Error({.problem = "linear_coulomb: the rate input is 0 throughout"});
  const double rms = std::sqrt(square_sum / static_cast<double>(rate.size()));
  const double lowest = 1e-3 * rms;
  const double scale = FrictionSearch(design, groups, rate).best_scale(lowest, largest);
  if (scale > 0.99 * largest)
    notes.emplace_back(
        "the friction still grows at the largest rate: the data do not distinguish it from a "
        "viscous one");
  if (scale < 1.01 * lowest)
    notes.emplace_back("the friction is a step in the rate: the data do not determine its scale");
  return scale;
}

}  // namespace

Fitted<Linear> fit_linear(const TrainingData& data, const LinearOptions& options) {
  Table table = usable_table(data);
  const Groups groups = groups_by(options.schedule, data, table.features);
  const Design design = affine_design(data, table, groups, options.rates, 0);
  if (std::ranges::all_of(design.terms.begin() + 1, design.terms.end(), &std::string::empty))
    throw Error(
        {.problem = "linear has no input to give a slope to: all of them are rates or "
                    "schedule the coefficients",
         .advice = "Add an input that is none, or let rates have slopes: --set rates=true."});
  DesignFit fit = fit_design(design, groups);
  Fitted<Linear> fitted{{std::move(fit.coefficients)}, std::move(fit.notes)};
  if (!options.rates)
    note_on_rates(fitted.notes, design, groups, data, table.features, Linear::kFamily);
  fitted.table =
      fitted_coefficients(fitted.parameters, fitted.parameters.coefficients.values, design, data);
  return fitted;
}

Fitted<LinearCoulomb> fit_linear_coulomb(const TrainingData& data,
                                         const LinearCoulombOptions& options) {
  Fitted<LinearCoulomb> fitted;
  LinearCoulomb::Parameters& parameters = fitted.parameters;
  parameters.rate_feature = first_rate(data, LinearCoulomb::kFamily);
  Table table = usable_table(data);
  const Groups groups = groups_by(options.schedule, data, table.features);
  Design design = affine_design(data, table, groups, options.rates, 1);
  std::vector<double> rate(table.features.rows);
  for (std::size_t n = 0; n < rate.size(); ++n)
    rate[n] = table.features(n, parameters.rate_feature);
  parameters.rate_scale = std::isnan(options.rate_scale)
                              ? found_scale(design, groups, rate, fitted.notes)
                              : options.rate_scale;

  const std::size_t friction = design.columns.columns - 1;
  design.terms[friction] = "the friction";
  for (std::size_t n = 0; n < rate.size(); ++n)
    design.columns(n, friction) = detail::hyperbolic_tangent(rate[n] / parameters.rate_scale);
  DesignFit fit = fit_design(design, groups);
  parameters.coefficients = std::move(fit.coefficients);
  std::ranges::move(fit.notes, std::back_inserter(fitted.notes));
  if (!options.rates)
    note_on_rates(fitted.notes, design, groups, data, table.features, LinearCoulomb::kFamily);
  fitted.table = fitted_coefficients(parameters, parameters.coefficients.values, design, data);
  return fitted;
}

}  // namespace torsio
