#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "fit/common/fitted.hpp"
#include "fit/common/regression.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"
#include "fit/hysteresis/operator_data.hpp"

namespace torsio {
namespace {

using Parameters = ImprovedPrandtlIshlinskii::Parameters;

/// theta: b, slopes (w_0 first), w_i, g_j, beta times the RMS of the rate.
class ImprovedRun {
 public:
  ImprovedRun(const OperatorData& data, Parameters start)
      : data_(data), parameters_(std::move(start)), limit_slope_(parameters_.weights.size()) {
    double sum = 0.0;
    std::size_t count = 0;
    for (const Stretch& stretch : data.stretches) {
      count += stretch.rate.size();
      for (const double rate : stretch.rate) sum += rate * rate;
    }
    if (sum > 0.0) rate_rms_ = std::sqrt(sum / static_cast<double>(count));
  }

  [[nodiscard]] std::size_t first_weight() const { return 1 + parameters_.slopes.size(); }
  [[nodiscard]] std::size_t first_bend() const {
    return first_weight() + parameters_.weights.size();
  }
  [[nodiscard]] std::size_t gain() const { return first_bend() + parameters_.bends.size(); }
  [[nodiscard]] std::size_t count() const { return gain() + 1; }

  [[nodiscard]] Parameters at(std::span<const double> theta) const {
    Parameters parameters = parameters_;
    const auto take = [&](std::size_t first, std::vector<double>& into) {
      std::ranges::copy(theta.subspan(first, into.size()), into.begin());
    };
    parameters.bias = theta[0];
    take(1, parameters.slopes);
    take(first_weight(), parameters.weights);
    take(first_bend(), parameters.bends);
    parameters.rate_gain = theta[gain()] / rate_rms_;
    return parameters;
  }

  bool evaluate(std::span<const double> theta, std::span<double> residuals,
                std::span<double> jacobian) {
    const Parameters now = at(theta);
    const ImprovedPrandtlIshlinskii model(now);
    SlipBank stops(now.thresholds, ImprovedPrandtlIshlinskii::kFamily);
    for (const Stretch& stretch : data_.stretches) {
      stops.reset();
      std::ranges::fill(limit_slope_, 0.0);
      Increment increment;
      for (std::size_t n = 0; n < stretch.x.size(); ++n) {
        const double speed = std::abs(stretch.rate[n]) / rate_rms_;
        const double scale = 1.0 + theta[gain()] * speed;
        stops.move(increment.step(stretch.x[n]), scale);
        follow_limits(stops, now.thresholds, scale, speed);
        const std::size_t row = stretch.row[n];
        if (row == Stretch::kUnused) continue;
        const double v = straight(now, stops, stretch.x[n]);
        residuals[row] = now.bias + model.bent(v) - data_.target[row];
        const auto others = data_.others.row(row);
        for (std::size_t j = 1; j < others.size(); ++j) residuals[row] += now.slopes[j] * others[j];
        if (!jacobian.empty())
          differentiate(now, stops, stretch.x[n], v, others,
                        jacobian.subspan(row * count(), count()));
      }
    }
    return true;
  }

 private:
  /// ds_i / d beta: what slips is at its limit, what sticks keeps what it had.
  void follow_limits(const SlipBank& stops, const std::vector<double>& thresholds, double scale,
                     double speed) {
    for (std::size_t i = 0; i < thresholds.size(); ++i) {
      const double force = stops.forces()[i];
      if (std::abs(force) >= thresholds[i] * scale)
        limit_slope_[i] = std::copysign(thresholds[i] * speed, force);
    }
  }

  static double straight(const Parameters& now, const SlipBank& stops, double x) {
    double v = now.slopes[0] * x;
    for (std::size_t i = 0; i < now.weights.size(); ++i)
      v += now.weights[i] * (x - stops.forces()[i]);
    return v;
  }

  void differentiate(const Parameters& now, const SlipBank& stops, double x, double v,
                     std::span<const double> others, std::span<double> line) const {
    double rise = 1.0;
    for (std::size_t j = 0; j < now.knots.size(); ++j) {
      const double knot = now.knots[j];
      const double beyond = knot > 0.0 ? std::max(v - knot, 0.0) : std::min(v - knot, 0.0);
      line[first_bend() + j] = beyond;
      if (beyond != 0.0) rise += now.bends[j];
    }
    line[0] = 1.0;
    line[1] = rise * x;
    for (std::size_t j = 1; j < others.size(); ++j) line[1 + j] = others[j];
    double by_gain = 0.0;
    for (std::size_t i = 0; i < now.weights.size(); ++i) {
      line[first_weight() + i] = rise * (x - stops.forces()[i]);
      by_gain -= now.weights[i] * limit_slope_[i];
    }
    line[gain()] = rise * by_gain;
  }

  const OperatorData& data_;
  Parameters parameters_;
  double rate_rms_ = 1.0;
  std::vector<double> limit_slope_;
};

/// Half of them on either side of 0, at even shares of the plain operator's output there.
std::vector<double> knots_of(const OperatorData& data, double bias, std::size_t count) {
  std::vector<double> knots;
  for (const double side : {-1.0, 1.0}) {
    double farthest = 0.0;
    for (const double target : data.target) farthest = std::max(farthest, side * (target - bias));
    const std::size_t here = side < 0.0 ? count / 2 : count - count / 2;
    for (std::size_t i = 1; i <= here && farthest > 0.0; ++i)
      knots.push_back(side * farthest * static_cast<double>(i) / static_cast<double>(here + 1));
  }
  std::ranges::sort(knots);
  return knots;
}

SearchOptions bounds_of(const ImprovedRun& run, const Parameters& start) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  SearchOptions options;
  options.lower.assign(run.count(), -kNone);
  options.upper.assign(run.count(), kNone);
  std::fill_n(options.upper.begin() + static_cast<std::ptrdiff_t>(run.first_weight()),
              start.weights.size(), 0.0);
  // However many bends add up on one side, S keeps a tenth of its slope.
  const auto most = static_cast<double>(std::max<std::size_t>(start.bends.size(), 1));
  for (std::size_t j = 0; j < start.bends.size(); ++j) {
    options.lower[run.first_bend() + j] = -0.9 / most;
    options.upper[run.first_bend() + j] = 10.0;
  }
  options.lower[run.gain()] = 0.0;
  options.upper[run.gain()] = 10.0;
  return options;
}

}  // namespace

Fitted<ImprovedPrandtlIshlinskii> fit_improved_prandtl_ishlinskii(
    const TrainingData& data, const ImprovedPrandtlIshlinskiiOptions& options,
    const Progress& progress) {
  constexpr auto kFamily = ImprovedPrandtlIshlinskii::kFamily;
  const std::size_t rate = first_rate(data, kFamily);
  const OperatorData runs =
      operator_data(data, options.rates, rate, kMaxResiduals,
                    2 + data.input_count() + options.thresholds + options.bends);
  const auto plain = fit_prandtl_ishlinskii(
      data,
      {.thresholds = options.thresholds, .passive = true, .rates = options.rates, .schedule = {}});
  const std::vector<double>& coefficients = plain.parameters.coefficients.values.values;
  const auto inputs = static_cast<std::ptrdiff_t>(data.input_count());
  Parameters start;
  start.bias = coefficients[0];
  start.slopes.assign(coefficients.begin() + 1, coefficients.begin() + 1 + inputs);
  start.weights.assign(coefficients.begin() + 1 + inputs, coefficients.end());
  start.thresholds = plain.parameters.thresholds;
  start.knots = knots_of(runs, start.bias, options.bends);
  start.bends.assign(start.knots.size(), 0.0);
  start.rate_feature = rate;
  ImprovedRun run(runs, start);
  std::vector<double> theta{start.bias};
  theta.insert(theta.end(), start.slopes.begin(), start.slopes.end());
  theta.insert(theta.end(), start.weights.begin(), start.weights.end());
  theta.resize(run.count(), 0.0);
  theta.back() = 0.01;
  const ResidualProblem problem{
      .residuals = runs.rows(),
      .evaluate = [&](std::span<const double> at, std::span<double> residuals,
                      std::span<double> jacobian) { return run.evaluate(at, residuals, jacobian); },
      .has_jacobian = true};
  SearchOptions search = bounds_of(run, start);
  search.max_iterations = options.max_iterations;
  search.progress = progress;
  const SearchResult found = converged_search(problem, {theta}, search, kFamily);
  Fitted<ImprovedPrandtlIshlinskii> fitted{run.at(found.theta), runs.notes};
  for (std::size_t j = 1; j < data.input_count(); ++j)
    if (runs.terms[j].empty()) fitted.parameters.slopes[j] = 0.0;
  fitted.table = {{"b", runs.torque_unit, fitted.parameters.bias},
                  {"w0", runs.stiffness_unit, fitted.parameters.slopes[0]},
                  {"beta", "", fitted.parameters.rate_gain}};
  return fitted;
}

}  // namespace torsio
