#include "fit/second_order/inverse_dynamics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "numerics/least_squares.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

struct Motion {
  double force = 0.0;
  double speed = 0.0;
  double acceleration = 0.0;
};

/// The parabola through 2 w + 1 samples, at the middle one (Savitzky and Golay).
class Parabola {
 public:
  Parabola(std::size_t half_width, double sample_rate_Hz)
      : half_(static_cast<std::ptrdiff_t>(half_width)), rate_Hz_(sample_rate_Hz) {
    for (std::ptrdiff_t i = -half_; i <= half_; ++i) {
      const auto square = static_cast<double>(i * i);
      count_ += 1.0;
      squares_ += square;
      fourths_ += square * square;
    }
  }
  [[nodiscard]] std::size_t half_width() const { return static_cast<std::size_t>(half_); }

  struct Fit {
    double value;
    double slope;
    double curvature;
  };
  /// @param sample i -> value at i samples from the middle
  template <class Sample>
  [[nodiscard]] Fit at(const Sample& sample) const {
    double sum = 0.0;
    double moment = 0.0;
    double second = 0.0;
    for (std::ptrdiff_t i = -half_; i <= half_; ++i) {
      const double each = sample(i);
      const auto x = static_cast<double>(i);
      sum += each;
      moment += x * each;
      second += x * x * each;
    }
    const double bend =
        (count_ * second - squares_ * sum) / (count_ * fourths_ - squares_ * squares_);
    return {.value = (sum - squares_ * bend) / count_,
            .slope = rate_Hz_ * moment / squares_,
            .curvature = 2.0 * rate_Hz_ * rate_Hz_ * bend};
  }

 private:
  std::ptrdiff_t half_;
  double rate_Hz_;
  double count_ = 0.0;
  double squares_ = 0.0;
  double fourths_ = 0.0;
};

std::vector<Motion> motions(const TrainingData& data, std::size_t half_width) {
  const Parabola parabola(half_width, data.sample_rate_Hz);
  std::vector<Motion> all;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = half_width; n + half_width < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const auto index = [n](std::ptrdiff_t i) {
        return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(n) + i);
      };
      const auto target = parabola.at([&](std::ptrdiff_t i) { return sequence.target[index(i)]; });
      const auto force =
          parabola.at([&](std::ptrdiff_t i) { return sequence.features(index(i), 0); });
      if (std::isfinite(target.curvature) && std::isfinite(force.value))
        all.push_back({force.value, target.slope, target.curvature});
    }
  return all;
}

}  // namespace

InverseDynamics inverse_dynamics(const TrainingData& data, double gain) {
  constexpr std::array<std::size_t, 3> kHalfWidths{5, 20, 80};
  constexpr double kSlowest = 0.05;
  InverseDynamics found;
  for (const std::size_t half_width : kHalfWidths) {
    const std::vector<Motion> all = motions(data, half_width);
    double largest = 0.0;
    for (const Motion& each : all) largest = std::max(largest, std::abs(each.speed));
    Matrix design(0, 4);
    std::vector<double> force;
    for (const Motion& each : all) {
      if (!(std::abs(each.speed) > kSlowest * largest)) continue;
      for (const double column :
           {each.acceleration, each.speed, std::copysign(1.0, each.speed), 1.0})
        design.values.push_back(column);
      force.push_back(gain * each.force);
    }
    design.rows = force.size();
    if (design.rows <= design.columns) continue;
    const std::vector<double> solved = least_squares(design, force).coefficients;
    if (!(solved[0] > 0.0)) continue;
    found.largest_speed = std::max(found.largest_speed, largest);
    found.guesses.push_back({.inertia = solved[0],
                             .viscous = std::max(solved[1], 0.0),
                             .coulomb = std::max(solved[2], 0.0),
                             .offset = solved[3]});
  }
  if (found.guesses.empty())
    throw Error({.place = "rigid_drive",
                 .expected = "a force that accelerates the target in its own direction",
                 .found = "no inertia that explains " + data.target,
                 .advice = "Check signs, which channel drives, and that the record is longer than "
                           "a few samples."});
  return found;
}

}  // namespace torsio
