#include "numerics/lbfgs.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <utility>

namespace torsio {
namespace {

using Vector = std::vector<double>;

constexpr std::size_t kPairs = 10;
constexpr double kArmijo = 1e-4;
constexpr int kTrials = 30;

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

struct Pair {
  Vector step;
  Vector change;  ///< change of the gradient
};

class Minimiser {
 public:
  Minimiser(const Differentiable& f, Vector start, const LbfgsSettings& settings)
      : f_(f), settings_(settings), gradient_(start.size()), held_(start.size()) {
    result_.at = clamped(std::move(start));
    result_.value = evaluate(result_.at, gradient_);
  }

  LbfgsResult run() {
    while (std::isfinite(result_.value) && result_.iterations < settings_.iterations) {
      if (steepest_free() <= settings_.gradient_tolerance) break;
      const double before = result_.value;
      if (!advance(direction()) && (pairs_.empty() || !advance_from_scratch())) break;
      ++result_.iterations;
      if (before - result_.value <= settings_.tolerance * std::max(1.0, std::abs(before))) break;
    }
    return std::move(result_);
  }

 private:
  double evaluate(const Vector& x, Vector& gradient) {
    ++result_.evaluations;
    const double value = f_(x, gradient);
    return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] Vector clamped(Vector x) const {
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!settings_.lowest.empty()) x[i] = std::max(x[i], settings_.lowest[i]);
      if (!settings_.highest.empty()) x[i] = std::min(x[i], settings_.highest[i]);
    }
    return x;
  }

  /// Marks the variables that a bound holds. @returns the largest component of the others.
  double steepest_free() {
    double largest = 0.0;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      const bool at_lowest = !settings_.lowest.empty() && result_.at[i] <= settings_.lowest[i];
      const bool at_highest = !settings_.highest.empty() && result_.at[i] >= settings_.highest[i];
      held_[i] = (at_lowest && gradient_[i] > 0.0) || (at_highest && gradient_[i] < 0.0);
      if (!held_[i]) largest = std::max(largest, std::abs(gradient_[i]));
    }
    return largest;
  }

  void drop_held(Vector& vector) const {
    for (std::size_t i = 0; i < vector.size(); ++i)
      if (held_[i]) vector[i] = 0.0;
  }

  /// Downhill, by the two-loop recursion.
  [[nodiscard]] Vector direction() const {
    Vector d = gradient_;
    drop_held(d);
    std::vector<double> shares(pairs_.size());
    for (std::size_t k = pairs_.size(); k-- > 0;) {
      shares[k] = dot(pairs_[k].step, d) / dot(pairs_[k].step, pairs_[k].change);
      for (std::size_t i = 0; i < d.size(); ++i) d[i] -= shares[k] * pairs_[k].change[i];
    }
    if (pairs_.empty()) {
      const double length = std::sqrt(dot(d, d));
      for (double& each : d) each *= std::min(1.0, settings_.first_step / length);
    } else {
      const Pair& last = pairs_.back();
      const double scale = dot(last.step, last.change) / dot(last.change, last.change);
      for (double& each : d) each *= scale;
    }
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const double share = dot(pairs_[k].change, d) / dot(pairs_[k].step, pairs_[k].change);
      for (std::size_t i = 0; i < d.size(); ++i) d[i] += (shares[k] - share) * pairs_[k].step[i];
    }
    drop_held(d);
    double longest = 0.0;
    for (const double each : d) longest = std::max(longest, std::abs(each));
    const double scale = longest > settings_.longest_step ? settings_.longest_step / longest : 1.0;
    for (double& each : d) each *= -scale;
    return d;
  }

  bool advance_from_scratch() {
    pairs_.clear();
    return advance(direction());
  }

  bool advance(const Vector& d) {
    double length = 1.0;
    Vector gradient(gradient_.size());
    for (int trial = 0; trial < kTrials; ++trial) {
      Vector x = result_.at;
      for (std::size_t i = 0; i < x.size(); ++i) x[i] += length * d[i];
      x = clamped(std::move(x));
      Vector step(x.size());
      std::ranges::transform(x, result_.at, step.begin(), std::minus<>());
      const double slope = dot(gradient_, step);
      if (!(slope < 0.0)) return false;
      const double value = evaluate(x, gradient);
      if (value <= result_.value + kArmijo * slope) {
        take(std::move(x), value, gradient, std::move(step));
        return true;
      }
      // The parabola through both values and the slope, kept within bounds.
      const double minimum = -0.5 * slope / (value - result_.value - slope);
      length *= std::isfinite(value) ? std::clamp(minimum, 0.1, 0.5) : 0.25;
    }
    return false;
  }

  void take(Vector x, double value, const Vector& gradient, Vector step) {
    Vector change(gradient.size());
    std::ranges::transform(gradient, gradient_, change.begin(), std::minus<>());
    if (dot(step, change) > 1e-10 * std::sqrt(dot(step, step) * dot(change, change))) {
      if (pairs_.size() == kPairs) pairs_.pop_front();
      pairs_.push_back({std::move(step), std::move(change)});
    }
    result_.at = std::move(x);
    result_.value = value;
    gradient_ = gradient;
  }

  const Differentiable& f_;
  const LbfgsSettings& settings_;
  LbfgsResult result_;
  Vector gradient_;
  std::vector<bool> held_;
  std::deque<Pair> pairs_;
};

}  // namespace

LbfgsResult minimise(const Differentiable& f, std::vector<double> start,
                     const LbfgsSettings& settings) {
  return Minimiser(f, std::move(start), settings).run();
}

}  // namespace torsio
