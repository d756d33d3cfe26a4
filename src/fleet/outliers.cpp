#include "fleet/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>

#include "numerics/quantile.hpp"
#include "numerics/student_t.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMembersOfTail = 100;
constexpr double kTailFrom = 0.75;
constexpr double kTailUpTo = 0.985;

/// P(X > u + y) of a generalised Pareto tail, without the share of the tail.
double survival(double y, double shape, double scale) {
  constexpr double kExponential = 1e-6;
  if (std::abs(shape) < kExponential) return std::exp(-y / scale);
  const double base = 1.0 + shape * y / scale;
  return base <= 0.0 ? 0.0 : std::pow(base, -1.0 / shape);
}

/// One side of a population, as distances from the median on that side.
class Tail {
 public:
  virtual ~Tail() = default;
  Tail(const Tail&) = delete;
  Tail& operator=(const Tail&) = delete;
  /// Upper bound of the probability that a sound member lies at least so far out.
  [[nodiscard]] virtual double probability(double distance) const = 0;

 protected:
  Tail() = default;
};

class ParetoTail : public Tail {
 public:
  /// @param distances signed: those of the other side are negative
  explicit ParetoTail(std::vector<double> distances) {
    std::ranges::sort(distances);
    const auto at = [&](double share) {
      return static_cast<std::size_t>(share * static_cast<double>(distances.size() - 1));
    };
    const std::size_t first = at(kTailFrom) + 1;
    const std::size_t last = at(kTailUpTo);
    begin_ = distances[first - 1];
    std::vector<double> excess;
    excess.reserve(last + 1 - first);
    for (std::size_t i = first; i <= last; ++i) excess.push_back(distances[i] - begin_);
    find_likely_tails(excess, distances.size() - last - 1);
  }

  [[nodiscard]] double probability(double distance) const override {
    if (distance <= begin_) return 1.0;
    double largest = 0.0;
    for (const auto& [shape, scale] : likely_)
      largest = std::max(largest, survival(distance - begin_, shape, scale));
    return (1.0 - kTailFrom) * largest;
  }

 private:
  struct Parameters {
    double shape = 0.0;
    double scale = 1.0;
  };

  /// The parameters within the likelihood region of 90 %, on a grid.
  void find_likely_tails(const std::vector<double>& excess, std::size_t censored) {
    constexpr int kShapes = 11;
    // A density that falls linearly to its end: that of parts within a tolerance whose estimates are noisy. Below it the
    // region of the likelihood does not hold either (Smith 1985).
    constexpr double kLowestShape = -0.5;
    constexpr double kHighestShape = 0.0;  // an exponential one
    constexpr int kScales = 97;
    constexpr double kScaleRange = 8.0;
    double mean = 0.0;
    for (const double y : excess) mean += y / static_cast<double>(excess.size());
    if (!(mean > 0.0)) {
      // Members that are all equal up to here: nothing is known about the tail.
      likely_.push_back({kHighestShape, std::numeric_limits<double>::infinity()});
      return;
    }
    std::vector<std::pair<double, Parameters>> all;
    all.reserve(static_cast<std::size_t>(kShapes) * kScales);
    for (int i = 0; i < kShapes; ++i)
      for (int j = 0; j < kScales; ++j) {
        const Parameters tail{
            .shape = kLowestShape + (kHighestShape - kLowestShape) * i / (kShapes - 1),
            .scale = mean * std::pow(kScaleRange, 2.0 * j / (kScales - 1) - 1.0)};
        all.emplace_back(log_likelihood(tail, excess, censored), tail);
      }
    const double best =
        std::ranges::max_element(all, {}, [](const auto& each) { return each.first; })->first;
    constexpr double kRegion = 2.303;  // half of the 90 % quantile of chi^2 with two parameters
    for (const auto& [value, tail] : all)
      if (value >= best - kRegion) likely_.push_back(tail);
  }

  static double log_likelihood(const Parameters& tail, const std::vector<double>& excess,
                               std::size_t censored) {
    constexpr double kNever = -std::numeric_limits<double>::infinity();
    constexpr double kExponential = 1e-6;
    double sum = 0.0;
    for (const double y : excess) {
      const double base = 1.0 + tail.shape * y / tail.scale;
      if (base <= 0.0) return kNever;
      sum -= std::abs(tail.shape) < kExponential ? y / tail.scale
                                                 : (1.0 / tail.shape + 1.0) * std::log(base);
    }
    sum -= static_cast<double>(excess.size()) * std::log(tail.scale);
    if (censored == 0) return sum;
    const double beyond = survival(excess.back(), tail.shape, tail.scale);
    return beyond > 0.0 ? sum + static_cast<double>(censored) * std::log(beyond) : kNever;
  }

  double begin_ = 0.0;
  std::vector<Parameters> likely_;
};

/// A tail of Student's distribution about the median.
class StudentTail : public Tail {
 public:
  explicit StudentTail(const std::vector<double>& distances)
      : freedom_((distances.size() - 1) / 3) {
    std::vector<double> sizes;
    sizes.reserve(distances.size());
    for (const double distance : distances) sizes.push_back(std::abs(distance));
    constexpr double kDeviationOverMad = 1.4826;
    deviation_ = kDeviationOverMad * quantile(std::move(sizes), 0.5);
  }

  [[nodiscard]] double probability(double distance) const override {
    if (!(deviation_ > 0.0)) return 1.0;
    return distance <= 0.0 ? 1.0 : 0.5 * (1.0 - student_t_within(distance / deviation_, freedom_));
  }

 private:
  std::size_t freedom_;
  double deviation_ = 0.0;
};

std::unique_ptr<Tail> tail_of(const std::vector<double>& distances) {
  if (distances.size() >= kMembersOfTail) return std::make_unique<ParetoTail>(distances);
  return std::make_unique<StudentTail>(distances);
}

/// The distance from which on fewer members than `max_expected` are expected; NaN: there is none.
double limit_of(const Tail& tail, double members, const OutlierOptions& options, double largest) {
  const auto is_beyond = [&](double distance) {
    return members * tail.probability(distance) < options.max_expected;
  };
  double high = std::max(largest, std::numeric_limits<double>::min());
  constexpr int kDoublings = 60;
  int doublings = 0;
  while (!is_beyond(high) && doublings++ < kDoublings) high *= 2.0;
  if (doublings > kDoublings) return kNotMeasured;
  double low = 0.0;
  constexpr int kHalvings = 60;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (is_beyond(middle) ? high : low) = middle;
  }
  return std::max(high, options.tolerance);
}

/// Those that are found do not belong to the population whose tail is fitted: it is fitted again without them.
void examine_side(OutlierTest& test, double side, double members, const OutlierOptions& options) {
  constexpr int kMaxRounds = 2;
  std::size_t found = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<double> distances;
    double largest = 0.0;
    for (const OutlierScore& score : test.scores) {
      if (!std::isfinite(score.distance)) continue;
      largest = std::max(largest, side * score.distance);
      if (!score.is_outlier || side * score.distance < 0.0)
        distances.push_back(side * score.distance);
    }
    const std::unique_ptr<Tail> tail = tail_of(distances);
    const double limit = limit_of(*tail, members, options, largest);
    (side > 0.0 ? test.highest : test.lowest) = test.median + side * limit;
    std::size_t count = 0;
    for (OutlierScore& score : test.scores) {
      const double distance = side * score.distance;
      if (!(distance >= 0.0)) continue;
      score.probability = tail->probability(distance);
      score.expected = members * score.probability;
      score.is_outlier = distance > limit;
      if (score.is_outlier) ++count;
    }
    if (count == found) return;
    found = count;
  }
}

}  // namespace

OutlierTest find_outliers(std::span<const double> values, const OutlierOptions& options) {
  OutlierTest test{.scores = std::vector<OutlierScore>(values.size())};
  std::vector<double> measured;
  measured.reserve(values.size());
  std::ranges::copy_if(values, std::back_inserter(measured),
                       [](double value) { return std::isfinite(value); });
  if (measured.empty()) return test;
  test.median = quantile(measured, 0.5);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isfinite(values[i])) test.scores[i].distance = values[i] - test.median;
  if (measured.size() < kLeastMembers) return test;
  test.has_fitted_tails = measured.size() >= kMembersOfTail;
  for (const double side : {1.0, -1.0})
    if (side > 0.0 || options.sides == OutlierSides::both)
      examine_side(test, side, static_cast<double>(measured.size()), options);
  return test;
}

}  // namespace torsio
