#include "evaluate/initial_state.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/all_finite.hpp"
#include "numerics/residual_search.hpp"

namespace torsio {
namespace {

/// Squares of the outputs' errors from a state, then of the distance from rest with a weight so
/// small that it is effective only where the samples do not determine the state.
class Start {
 public:
  Start(AnyModel& model, const Matrix& features, std::span<const double> target, double usual_error)
      : model_(model), features_(features), target_(target) {
    model_.reset();
    rest_.assign(model_.state().begin(), model_.state().end());
    for (std::size_t n = 0; n < target.size(); ++n)
      if (std::isfinite(target[n]) && all_finite(features.row(n))) scored_.push_back(n);
    if (scored_.empty()) return;
    const auto [least, most] =
        std::ranges::minmax_element(scored_, {}, [&](std::size_t n) { return target[n]; });
    const double lowest = target[*least];
    const double highest = target[*most];
    spread_ = std::max(highest - lowest, std::max(std::abs(lowest), std::abs(highest)));
    constexpr double kUnknownShare = 0.01;
    const double error = usual_error > 0.0 ? usual_error : kUnknownShare * spread_;
    if (error > 0.0) weight_ = 1.0 / (error * std::sqrt(static_cast<double>(scored_.size())));
  }

  [[nodiscard]] const std::vector<double>& rest() const { return rest_; }
  [[nodiscard]] bool is_determined() const { return !rest_.empty() && !scored_.empty(); }
  [[nodiscard]] std::size_t residuals() const { return scored_.size() + rest_.size(); }

  /// For each state, the change that moves an output by the target's spread; 1 if no output depends
  /// on it.
  [[nodiscard]] std::vector<double> typical() {
    constexpr double kProbe = 1e-6;
    const std::vector<double> unit(rest_.size(), 1.0);
    std::vector<double> at_rest(residuals());
    std::vector<double> moved(residuals());
    evaluate(rest_, unit, at_rest);
    std::vector<double> typical = unit;
    std::vector<double> state = rest_;
    for (std::size_t j = 0; j < rest_.size(); ++j) {
      const double probe = kProbe * std::max(std::abs(rest_[j]), kProbe);
      state[j] = rest_[j] + probe;
      evaluate(state, unit, moved);
      state[j] = rest_[j];
      double change = 0.0;
      for (std::size_t n = 0; n < scored_.size(); ++n)
        change = std::max(change, std::abs(moved[n] - at_rest[n]));
      if (std::isfinite(change) && change > 0.0 && spread_ > 0.0)
        typical[j] = spread_ * weight_ * probe / change;
    }
    return typical;
  }

  bool evaluate(std::span<const double> state, std::span<const double> typical,
                std::span<double> residuals) {
    constexpr double kRestWeight =
        0.2;  // small, so that a drive's speed is not biased towards rest
    model_.reset();
    model_.set_state(state);
    std::size_t next = 0;
    for (std::size_t n = 0; n < target_.size(); ++n) {
      if (!all_finite(features_.row(n))) continue;
      const double value = model_.step(features_.row(n)).value;
      if (next < scored_.size() && scored_[next] == n)
        residuals[next++] = weight_ * (value - target_[n]);
    }
    for (std::size_t j = 0; j < rest_.size(); ++j)
      residuals[scored_.size() + j] = kRestWeight * (state[j] - rest_[j]) / typical[j];
    return true;
  }

 private:
  AnyModel& model_;
  const Matrix& features_;
  std::span<const double> target_;
  std::vector<double> rest_;
  std::vector<std::size_t> scored_;
  double spread_ = 0.0;  ///< root mean square of the measured outputs
  double weight_ = 1.0;  ///< weight of an output's error
};

}  // namespace

void start_where_measured(AnyModel& model, const Matrix& features, std::span<const double> target,
                          double usual_error) {
  Start start(model, features, target, usual_error);
  if (!start.is_determined()) return;
  const std::vector<double>& rest = start.rest();
  const std::vector<double> typical = start.typical();
  const ResidualProblem problem{
      .residuals = start.residuals(),
      .evaluate = [&](std::span<const double> state, std::span<double> residuals,
                      std::span<double> /*jacobian*/) {
        return start.evaluate(state, typical, residuals);
      }};
  std::vector<double> at_rest(problem.residuals);
  start.evaluate(rest, typical, at_rest);
  double rest_error = 0.0;
  for (const double each : at_rest) rest_error += each * each;
  const SearchResult found = minimise_squares(problem, rest, {.typical = typical});
  model.reset();
  if (found.sum_of_squares < rest_error) model.set_state(found.theta);
}

}  // namespace torsio
