#include <algorithm>
#include <cmath>
#include <optional>

#include "fit/common/fitted.hpp"
#include "fit/common/regression.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"
#include "fit/hysteresis/operator_data.hpp"
#include "fit/linear/fit_polynomial.hpp"
#include "model/linear/direction.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Position of each parameter in theta: powers of m, Bernstein weights of h, slopes, then log k
/// and, by rate, beta and alpha of |x_r| in multiples of its RMS.
struct Layout {
  std::size_t size;  ///< degree + 1
  std::size_t inputs;
  [[nodiscard]] std::size_t linear() const { return 2 * size + inputs; }
  [[nodiscard]] std::size_t stiffness() const { return linear(); }
  [[nodiscard]] std::size_t gain() const { return linear() + 1; }
  [[nodiscard]] std::size_t exponent() const { return linear() + 2; }
};

/// The operator with the derivatives of its torque by theta, which are those of whatever holds it:
/// the spring, or one of the boundaries.
class BacklashRun {
 public:
  BacklashRun(const OperatorData& data, const Layout& layout, bool by_rate)
      : data_(data), layout_(layout), by_rate_(by_rate), basis_(2 * layout.size) {
    double sum = 0.0;
    std::size_t count = 0;
    for (const Stretch& stretch : data.stretches)
      for (const double rate : stretch.rate) {
        sum += rate * rate;
        ++count;
      }
    if (sum > 0.0) rate_rms_ = std::sqrt(sum / static_cast<double>(count));
  }

  [[nodiscard]] std::size_t parameters() const { return layout_.linear() + (by_rate_ ? 3 : 1); }
  [[nodiscard]] double rate_rms() const { return rate_rms_; }

  bool evaluate(std::span<const double> theta, std::span<double> residuals,
                std::span<double> jacobian) {
    const std::size_t count = parameters();
    gradient_.assign(count, 0.0);
    for (const Stretch& stretch : data_.stretches) {
      Increment increment;
      double torque = 0.0;
      for (std::size_t n = 0; n < stretch.x.size(); ++n) {
        torque = step(theta, stretch, n, increment, torque, !jacobian.empty());
        const std::size_t row = stretch.row[n];
        if (row == Stretch::kUnused) continue;
        residuals[row] = torque - data_.target[row];
        const auto others = data_.others.row(row);
        for (std::size_t j = 0; j < others.size(); ++j)
          residuals[row] += theta[2 * layout_.size + j] * others[j];
        if (jacobian.empty()) continue;
        const auto line = jacobian.subspan(row * count, count);
        std::ranges::copy(gradient_, line.begin());
        for (std::size_t j = 0; j < others.size(); ++j) line[2 * layout_.size + j] = others[j];
      }
    }
    return true;
  }

 private:
  double step(std::span<const double> theta, const Stretch& stretch, std::size_t n,
              Increment& increment, double torque, bool with_gradient) {
    const std::size_t size = layout_.size;
    const double z = (stretch.x[n] - data_.centre) / data_.half_range;
    const std::span basis(basis_);
    powers(z, basis.first(size));
    bernstein(z, basis.subspan(size));
    double middle = 0.0;
    double width = 0.0;
    for (std::size_t j = 0; j < size; ++j) {
      middle += theta[j] * basis[j];
      width += theta[size + j] * basis[size + j];
    }
    const double speed = by_rate_ ? std::abs(stretch.rate[n]) / rate_rms_ : 0.0;
    const double growth = by_rate_ ? std::pow(speed, theta[layout_.exponent()]) : 0.0;
    const double scale = by_rate_ ? 1.0 + theta[layout_.gain()] * growth : 1.0;
    const double stiffness = std::exp(theta[layout_.stiffness()]);
    const bool is_first = !increment.has_last();
    const double pull = stiffness * increment.step(stretch.x[n]);
    const double elastic = torque + pull;
    double side = 0.0;
    if (!is_first && elastic >= scale * (middle - width) && elastic <= scale * (middle + width)) {
      if (with_gradient) gradient_[layout_.stiffness()] += pull;
      return elastic;
    }
    if (!is_first) side = elastic > scale * (middle + width) ? 1.0 : -1.0;
    const double boundary = middle + side * width;
    if (!with_gradient) return scale * boundary;
    std::ranges::fill(gradient_, 0.0);
    for (std::size_t j = 0; j < size; ++j) {
      gradient_[j] = scale * basis[j];
      gradient_[size + j] = scale * side * basis[size + j];
    }
    if (by_rate_) {
      gradient_[layout_.gain()] = growth * boundary;
      gradient_[layout_.exponent()] =
          speed > 0.0 ? theta[layout_.gain()] * growth * std::log(speed) * boundary : 0.0;
    }
    return scale * boundary;
  }

  const OperatorData& data_;
  Layout layout_;
  bool by_rate_;
  double rate_rms_ = 1.0;
  std::vector<double> basis_;
  std::vector<double> gradient_;
};

/// Boundaries and slopes as if the torque were on one of them all the time.
std::vector<double> boundaries_by_direction(const OperatorData& data, const Layout& layout,
                                            double dead_band) {
  Matrix columns(data.rows(), layout.linear());
  std::vector<std::uint8_t> is_free(layout.linear(), 1);
  std::fill_n(is_free.begin() + static_cast<std::ptrdiff_t>(layout.size), layout.size, 0);
  std::vector<double> basis(layout.size);
  for (const Stretch& stretch : data.stretches) {
    DirectionTracker tracker(dead_band);
    for (std::size_t n = 0; n < stretch.x.size(); ++n) {
      const Direction direction = tracker.step(stretch.x[n]);
      if (stretch.row[n] == Stretch::kUnused) continue;
      const auto row = columns.row(stretch.row[n]);
      const double z = (stretch.x[n] - data.centre) / data.half_range;
      powers(z, row.first(layout.size));
      bernstein(z, basis);
      const double side = direction == Direction::unknown  ? 0.0
                          : direction == Direction::rising ? 1.0
                                                           : -1.0;
      for (std::size_t j = 0; j < layout.size; ++j) row[layout.size + j] = side * basis[j];
      std::ranges::copy(data.others.row(stretch.row[n]),
                        row.begin() + static_cast<std::ptrdiff_t>(2 * layout.size));
    }
  }
  std::vector<double> residuals(data.rows());
  return solve_linear(columns, data.target, is_free, residuals).coefficients;
}

/// The boundaries' mean slope: what they change by over the range.
double mean_slope(const OperatorData& data, std::span<const double> middle) {
  double change = 0.0;
  for (std::size_t i = 1; i < middle.size(); i += 2) change += middle[i];
  return std::abs(change) / data.half_range;
}

struct Starts {
  std::vector<std::vector<double>> theta;
  std::vector<double> lower;
  std::vector<double> upper;
  std::vector<double> typical;
};

Starts starts_of(const OperatorData& data, const Layout& layout, std::vector<double> linear,
                 bool by_rate) {
  Starts starts;
  double spread = 0.0;
  for (const double each : data.target) spread = std::max(spread, std::abs(each));
  if (spread == 0.0) spread = 1.0;
  const double slope = std::max(mean_slope(data, std::span(linear).first(layout.size)),
                                1e-3 * spread / data.half_range);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  starts.lower.assign(linear.size(), -kNone);
  std::fill_n(starts.lower.begin() + static_cast<std::ptrdiff_t>(layout.size), layout.size, 0.0);
  starts.upper.assign(linear.size(), kNone);
  starts.typical.assign(2 * layout.size, 0.1 * spread);
  for (std::size_t j = 0; j < layout.inputs; ++j) {
    double largest = 0.0;
    for (std::size_t n = 0; n < data.rows(); ++n)
      largest = std::max(largest, std::abs(data.others(n, j)));
    starts.typical.push_back(largest > 0.0 ? spread / largest : 1.0);
  }
  starts.lower.push_back(std::log(slope) - 3.0);
  starts.upper.push_back(std::log(slope) + 9.0);
  starts.typical.push_back(1.0);
  if (by_rate) {
    starts.lower.insert(starts.lower.end(), {0.0, 0.05});
    starts.upper.insert(starts.upper.end(), {10.0, 3.0});
    starts.typical.insert(starts.typical.end(), {0.1, 0.5});
  }
  for (const double stiffer : {2.0, 6.0, 30.0}) {
    starts.theta.push_back(linear);
    starts.theta.back().push_back(std::log(stiffer * slope));
    if (by_rate) starts.theta.back().insert(starts.theta.back().end(), {0.02, 0.7});
  }
  return starts;
}

template <bool kByRate>
Fitted<Backlash<kByRate>> fit(const TrainingData& data, const BacklashOptions& options,
                              const Progress& progress) {
  constexpr auto kFamily = Backlash<kByRate>::kFamily;
  const std::size_t rate = kByRate ? first_rate(data, kFamily) : 0;
  const Layout layout{options.degree + 1, data.input_count()};
  const OperatorData runs =
      operator_data(data, options.rates, rate, kMaxResiduals, layout.linear() + 3);
  BacklashRun run(runs, layout, kByRate);
  const Starts starts = starts_of(
      runs, layout, boundaries_by_direction(runs, layout, default_dead_band(data)), kByRate);
  const ResidualProblem problem{
      .residuals = runs.rows(),
      .evaluate =
          [&](std::span<const double> theta, std::span<double> residuals,
              std::span<double> jacobian) { return run.evaluate(theta, residuals, jacobian); },
      .has_jacobian = true};
  const SearchResult found = converged_search(problem, starts.theta,
                                              {.max_iterations = options.max_iterations,
                                               .lower = starts.lower,
                                               .upper = starts.upper,
                                               .typical = starts.typical,
                                               .progress = progress},
                                              kFamily);
  const std::span theta(found.theta);
  const auto size = static_cast<std::ptrdiff_t>(layout.size);
  Fitted<Backlash<kByRate>> fitted{.parameters = {}, .notes = runs.notes};
  auto& parameters = fitted.parameters;
  parameters.stiffness = std::exp(theta[layout.stiffness()]);
  parameters.boundaries = {
      .middle = {theta.begin(), theta.begin() + size},
      .half_width = powers_of_bernstein(theta.subspan(layout.size, layout.size)),
      .centre = runs.centre,
      .half_range = runs.half_range};
  parameters.slopes.assign(theta.begin() + 2 * size,
                           theta.begin() + static_cast<std::ptrdiff_t>(layout.linear()));
  // A slope that no column determines keeps its start value.
  for (std::size_t j = 0; j < layout.inputs; ++j)
    if (runs.terms[j].empty()) parameters.slopes[j] = 0.0;
  const ParameterUncertainty uncertainty = uncertainty_of(problem, found.theta, starts.typical);
  const auto error = [&](std::size_t i) { return uncertainty.std_error[i]; };
  fitted.table = {{"k", runs.stiffness_unit, parameters.stiffness,
                   parameters.stiffness * error(layout.stiffness())}};
  if constexpr (kByRate) {
    const double alpha = theta[layout.exponent()];
    const double unit = std::pow(run.rate_rms(), -alpha);
    parameters.rate = {theta[layout.gain()] * unit, alpha, rate};
    fitted.table.push_back({"beta", "", parameters.rate.gain, error(layout.gain()) * unit});
    fitted.table.push_back({"alpha", "", alpha, error(layout.exponent())});
  }
  return fitted;
}

}  // namespace

Fitted<NonlinearBacklash> fit_nonlinear_backlash(const TrainingData& data,
                                                 const BacklashOptions& options,
                                                 const Progress& progress) {
  return fit<false>(data, options, progress);
}

Fitted<ImprovedNonlinearBacklash> fit_improved_nonlinear_backlash(const TrainingData& data,
                                                                  const BacklashOptions& options,
                                                                  const Progress& progress) {
  return fit<true>(data, options, progress);
}

}  // namespace torsio
