#include "evaluate/drift/torque_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "model/hysteresis/slip_bank.hpp"
#include "numerics/nnls.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::size_t kKnots = 13;
constexpr std::size_t kStops = 7;
constexpr double kSmallestStop = 0.003;  // threshold over half of the range
constexpr double kLargestStop = 0.16;
constexpr double kWider = 2.0;

/// Knots over the x that occurs.
class Curve {
 public:
  explicit Curve(std::span<const PartsRun> runs) {
    double highest = -std::numeric_limits<double>::infinity();
    lowest_ = -highest;
    for (const PartsRun& run : runs)
      for (const std::size_t n : run.rows) {
        lowest_ = std::min(lowest_, run.x[n]);
        highest = std::max(highest, run.x[n]);
      }
    step_ = (highest - lowest_) / static_cast<double>(kKnots - 1);
  }

  /// Left knot and share of the way to the right one.
  [[nodiscard]] std::pair<std::size_t, double> at(double x) const {
    const double position = std::clamp((x - lowest_) / step_, 0.0, static_cast<double>(kKnots - 1));
    const std::size_t left = std::min(static_cast<std::size_t>(position), kKnots - 2);
    return {left, position - static_cast<double>(left)};
  }
  [[nodiscard]] double value(std::span<const double> knots, double x) const {
    const auto [left, share] = at(x);
    return (1.0 - share) * knots[left] + share * knots[left + 1];
  }
  [[nodiscard]] double slope(std::span<const double> knots, double x) const {
    const std::size_t left = at(x).first;
    return (knots[left + 1] - knots[left]) / step_;
  }
  /// The first x at which the curve is 0.
  [[nodiscard]] double root(std::span<const double> knots) const {
    for (std::size_t k = 0; k + 1 < kKnots; ++k) {
      if (knots[k] * knots[k + 1] > 0.0 || knots[k] == knots[k + 1]) continue;
      const double share = knots[k] / (knots[k] - knots[k + 1]);
      return lowest_ + step_ * (static_cast<double>(k) + share);
    }
    return kNotMeasured;
  }

 private:
  double lowest_ = 0.0;
  double step_ = 1.0;
};

std::vector<double> thresholds(double half_range, double factor) {
  std::vector<double> all(kStops);
  for (std::size_t i = 0; i < kStops; ++i)
    all[i] = factor * half_range * kSmallestStop *
             std::pow(kLargestStop / kSmallestStop,
                      static_cast<double>(i) / static_cast<double>(kStops - 1));
  return all;
}

/// Columns: knots, stops, stops times the load, other inputs.
class Rows {
 public:
  /// @param factor of all thresholds
  Rows(std::span<const PartsRun> runs, double lowest, double highest, double factor = 1.0)
      : curve_(runs),
        middle_(0.5 * (lowest + highest)),
        half_(0.5 * (highest - lowest)),
        inputs_(runs.front().features->columns),
        values_(kKnots + 2 * kStops + inputs_ - 1),
        stops_(thresholds(half_, factor), "drift") {}

  [[nodiscard]] std::size_t columns() const { return values_.size(); }
  [[nodiscard]] const Curve& curve() const { return curve_; }

  /// Calls visit(row, output, x) at each row of the run.
  template <class Visit>
  void run(const PartsRun& of, const Visit& visit) {
    stops_.reset();
    std::size_t next = 0;
    for (std::size_t n = 0; n < of.x.size() && next < of.rows.size(); ++n) {
      if (n > 0) stops_.move(of.x[n] - of.x[n - 1]);
      if (n != of.rows[next]) continue;
      ++next;
      std::ranges::fill(values_, 0.0);
      const auto [left, share] = curve_.at(of.x[n]);
      values_[left] = 1.0 - share;
      values_[left + 1] = share;
      const double load = std::abs(of.x[n] - middle_) / half_;
      for (std::size_t i = 0; i < kStops; ++i) {
        values_[kKnots + i] = stops_.forces()[i] / stops_.limit()[i];
        values_[kKnots + kStops + i] = load * values_[kKnots + i];
      }
      for (std::size_t j = 1; j < inputs_; ++j)
        values_[kKnots + 2 * kStops + j - 1] = (*of.features)(n, j);
      visit(std::span<const double>(values_), of.output[n], of.x[n]);
    }
  }

 private:
  Curve curve_;
  double middle_;
  double half_;
  std::size_t inputs_;
  std::vector<double> values_;
  SlipBank stops_;
};

double friction_of(std::span<const double> fitted, std::span<const double> row) {
  double friction = 0.0;
  for (std::size_t i = kKnots; i < kKnots + 2 * kStops; ++i) friction += fitted[i] * row[i];
  return friction;
}

}  // namespace

TorqueParts torque_parts(std::span<const PartsRun> runs, double lowest, double highest) {
  Rows rows(runs, lowest, highest);
  NormalEquations sums(rows.columns());
  for (const PartsRun& run : runs)
    rows.run(run, [&](std::span<const double> row, double output, double /*x*/) {
      sums.add(row, output);
    });
  std::vector<std::uint8_t> is_free(rows.columns(), 1);
  std::fill_n(is_free.begin() + kKnots, 2 * kStops, std::uint8_t{0});
  const std::vector<double> fitted = non_negative_least_squares(sums, is_free).coefficients;
  const auto knots = std::span(fitted).first(kKnots);
  TorqueParts parts;
  parts.middle = rows.curve().root(knots);
  for (const PartsRun& run : runs)
    rows.run(run, [&](std::span<const double> row, double /*output*/, double x) {
      parts.elastic.push_back(rows.curve().value(knots, x));
      parts.stiffness.push_back(rows.curve().slope(knots, x));
      parts.friction.push_back(friction_of(fitted, row));
    });
  Rows wider(runs, lowest, highest, kWider);
  for (const PartsRun& run : runs)
    wider.run(run, [&](std::span<const double> row, double /*output*/, double /*x*/) {
      const double before = parts.friction[parts.widening.size()];
      parts.widening.push_back(friction_of(fitted, row) - before);
    });
  return parts;
}

}  // namespace torsio
