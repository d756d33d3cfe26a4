#include "check/delay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "check/hysteresis_fit.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 0.6;
constexpr double kCoarseStep_s = 2e-3;
constexpr std::size_t kFewSamples = 200;
constexpr double kExplainsLittle = 0.2;  ///< share of the variance: there is no delay to find
constexpr double kLateShare = 0.87;      ///< share of the rest without shift
constexpr double kClearLag_s = 0.02;
constexpr double kRise = 0.15;
constexpr double kMaxRise = 8.0;
constexpr double kLongestLead_s = 0.1;
constexpr double kEarlyShare = 0.4;
constexpr double kEarlyRest = 0.01;
constexpr double kShortest_s = 8e-3;
constexpr double kSpeedHalfWindow_s = 0.02;
constexpr double kScaleShare = 0.1;
constexpr double kScaleRest = 2e-3;  ///< a torque that changed its gain leaves more
constexpr double kSideShare = 0.4;
constexpr double kSmallScale = 0.01;
constexpr double kInverted = -0.5;  ///< an angle that does not move, or has the wrong sign
constexpr double kFar = 5.0;
constexpr double kSome = 1.5;
constexpr double kSmallRest = 0.2;

/// The samples between the first and the last finite one.
std::pair<std::size_t, std::size_t> finite_part(const std::vector<double>& values) {
  std::size_t begin = 0;
  std::size_t end = values.size();
  while (begin < end && !is_finite(values[begin])) ++begin;
  while (end > begin && !is_finite(values[end - 1])) --end;
  return {begin, end};
}

/// Share that a delay leaves of what is unexplained without shift, at most: the error without shift
/// grows with the square of the delay, so that a long one must explain more. The valley of a slow
/// motion is flat, and its lowest point a matter of chance.
double greatest_share(double lag_s) {
  const double lags = std::abs(lag_s) / kClearLag_s;
  return std::min(kLateShare, 1.0 / (1.0 + kRise * std::min(lags * lags, kMaxRise)));
}

double shortest_lag_s(double sample_rate_Hz) { return std::max(kShortest_s, 1.5 / sample_rate_Hz); }

/// Unexplained shares over shifts of the target.
class Search {
 public:
  Search(const Pair& pair, double sample_rate_Hz) : pair_(pair) {
    const auto [begin, end] = finite_part(pair.target);
    longest_ = std::min(static_cast<std::ptrdiff_t>(std::round(kLongest_s * sample_rate_Hz)),
                        static_cast<std::ptrdiff_t>((end - begin) / 8));
    samples_ = samples_for_fit(pair.input, begin + static_cast<std::size_t>(longest_),
                               end - static_cast<std::size_t>(longest_));
  }
  [[nodiscard]] bool is_possible() const { return longest_ > 0 && samples_.size() >= kFewSamples; }

  [[nodiscard]] Delay run(double sample_rate_Hz) const {
    const FixedColumns columns(hysteresis_columns(pair_.input, samples_));
    const auto unexplained = [&](std::ptrdiff_t lag) {
      return columns.unexplained(at_samples(pair_.target, samples_, lag));
    };
    const auto step = std::max<std::ptrdiff_t>(
        1, static_cast<std::ptrdiff_t>(std::round(kCoarseStep_s * sample_rate_Hz)));
    std::vector<std::pair<std::ptrdiff_t, double>> shares;
    for (std::ptrdiff_t lag = -(longest_ / step) * step; lag <= longest_; lag += step)
      shares.emplace_back(lag, unexplained(lag));
    auto best = *std::ranges::min_element(shares, {}, &std::pair<std::ptrdiff_t, double>::second);
    const std::ptrdiff_t coarse = best.first;
    for (std::ptrdiff_t lag = std::max(-longest_, coarse - step + 1);
         lag < std::min(longest_, coarse + step); ++lag)
      if (const double share = unexplained(lag); share < best.second) best = {lag, share};
    Delay delay{.lag_s = static_cast<double>(best.first) / sample_rate_Hz,
                .unexplained = best.second,
                .without_shift = unexplained(0),
                .shortest_s = std::numeric_limits<double>::infinity(),
                .is_at_end = std::abs(best.first) + step > longest_};
    for (const auto& [lag, share] : shares)
      if (lag < best.first && kLateShare * share >= best.second)
        delay.shortest_s = static_cast<double>(best.first - lag) / sample_rate_Hz;
    return delay;
  }

 private:
  const Pair& pair_;
  std::ptrdiff_t longest_ = 0;
  std::vector<std::size_t> samples_;
};

}  // namespace

std::optional<Delay> estimate_delay(const Pair& pair, double sample_rate_Hz) {
  const Search search(pair, sample_rate_Hz);
  if (!search.is_possible()) return {};
  return search.run(sample_rate_Hz);
}

bool is_late(const Delay& delay, double sample_rate_Hz) {
  return delay.unexplained <= kExplainsLittle && delay.lag_s >= shortest_lag_s(sample_rate_Hz) &&
         delay.unexplained <= greatest_share(delay.lag_s) * delay.without_shift;
}

bool is_early(const Delay& delay, double sample_rate_Hz) {
  return delay.lag_s <= -shortest_lag_s(sample_rate_Hz) && delay.lag_s >= -kLongestLead_s &&
         delay.unexplained <= kEarlyRest &&
         delay.unexplained <=
             std::min(kEarlyShare, greatest_share(delay.lag_s)) * delay.without_shift;
}

std::optional<TwoSides> relate_sides(const std::vector<double>& first,
                                     const std::vector<double>& second,
                                     const std::vector<double>& torque, double sample_rate_Hz) {
  const auto half_window =
      static_cast<std::size_t>(std::max(1.0, std::round(kSpeedHalfWindow_s * sample_rate_Hz)));
  const std::vector<double> moved = movement(second, half_window);
  std::vector<double> known(first.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = first[i] + moved[i] + torque[i];
  const std::vector<std::size_t> samples = samples_for_fit(known, 0, known.size());
  if (samples.size() < kFewSamples) return {};
  const FixedColumns columns(hysteresis_columns(torque, samples));
  const double window_s = 2.0 * static_cast<double>(half_window) / sample_rate_Hz;
  const Eigen::VectorXd angle = at_samples(second, samples);
  const Eigen::VectorXd difference = at_samples(first, samples) - angle;
  const Eigen::VectorXd scale = columns.residual(angle);
  const Eigen::VectorXd speed = columns.residual(at_samples(moved, samples) / window_s);
  const Eigen::VectorXd rest = columns.residual(difference);
  const auto left_by = [&](const Eigen::MatrixXd& extra) {
    const Eigen::VectorXd solution = extra.colPivHouseholderQr().solve(rest);
    return std::pair{share_of_variance(rest - extra * solution, difference), solution};
  };
  Eigen::MatrixXd both(rest.size(), 2);
  both << scale, speed;
  const auto [unexplained, solution] = left_by(both);
  const auto width = [](const Eigen::VectorXd& values) {
    return values.maxCoeff() - values.minCoeff();
  };
  const double deflection = width(difference - solution(0) * angle);
  const double travel = std::min(width(angle), width(difference + angle));
  return TwoSides{.excess = solution(0),
                  .lateness_s = -solution(1),
                  .unexplained = unexplained,
                  .without_excess = left_by(speed).first,
                  .without_lateness = left_by(scale).first,
                  .travel = deflection > 0.0 ? travel / deflection : 0.0};
}

bool has_wrong_scale(const TwoSides& sides) {
  return sides.travel >= kFar && sides.unexplained <= kScaleRest &&
         std::abs(sides.excess) >= kSmallScale && sides.excess > kInverted &&
         sides.unexplained <= kScaleShare * sides.without_excess;
}

bool has_late_side(const TwoSides& sides, double sample_rate_Hz) {
  return sides.travel >= kSome && sides.unexplained <= kSmallRest &&
         std::abs(sides.lateness_s) >= shortest_lag_s(sample_rate_Hz) &&
         sides.unexplained <= kSideShare * sides.without_lateness;
}

}  // namespace torsio
