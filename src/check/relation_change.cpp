// The torque at equal input, compared between parts of one recording.
#include "check/relation_change.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "check/hysteresis_fit.hpp"
#include "check/torque_relation.hpp"
#include "numerics/nnls.hpp"
#include "numerics/reversals.hpp"

namespace torsio {
namespace {

constexpr std::size_t kCandidates = 80;
constexpr std::size_t kFewestReversals = 2;
constexpr double kChangeLeaves = 0.25;  ///< share of what is unexplained without the change
constexpr double kOffsetShare = 0.05;   ///< share of the torque's range
constexpr double kSlopeChange = 0.12;
constexpr double kSmallTorqueRest = 0.01;  ///< share of the torque's variance
constexpr std::size_t kManyReversals = 5;
constexpr double kPartShare = 0.2;   ///< share of the input's range that each part passes through
constexpr double kInputStep = 0.05;  ///< share of the input's range within which inputs are equal
constexpr auto kSettlings =
    std::to_array<double>({0.05, 0.15, 0.4});  // time constants of a warm-up over the duration
constexpr double kAnySpeed = 0.0;
constexpr double kSpeedsOfAMotion = 3.0;
constexpr std::size_t kOffParts = 20;  ///< parts of a recording that are looked at
constexpr std::size_t kMaxOff = 6;     ///< parts
constexpr double kOffExpected = 0.1;   ///< share of the target's range
constexpr double kOffPassed = 0.1;     ///< share of what is expected

/// With a friction that depends on the load: the stops times the scaled input. Without them its two branches would be
/// two slopes, one early and one late.
Eigen::MatrixXd with_loaded_stops(const Eigen::MatrixXd& columns) {
  const Eigen::Index stops = columns.cols() - kStaticColumns;
  Eigen::MatrixXd all(columns.rows(), columns.cols() + stops);
  all << columns, columns.rightCols(stops).array().colwise() * columns.col(1).array();
  return all;
}

/// Whether input and target pass through a good part of their ranges in [begin, end), and the input
/// reverses there.
bool is_excited(const Pair& pair, const std::pair<Extent, Extent>& all, Eigen::Index begin,
                Eigen::Index end) {
  const auto first = static_cast<std::size_t>(begin);
  const auto last = static_cast<std::size_t>(end);
  const auto [input, target] = known_extents(pair, first, last);
  return input.width() > kPartShare * all.first.width() &&
         target.width() > kPartShare * all.second.width() &&
         count_reversals(std::span(pair.input).subspan(first, last - first), 1) > 0;
}

/// Equal numbers are equal inputs after equal motion.
/// @param columns `hysteresis_columns`
/// @param stops so many of the stop operators describe the motion; the last ones keep most of it
/// @param speeds equal speeds are within this factor; 0: all are equal
class EqualMotion {
 public:
  EqualMotion(const Eigen::MatrixXd& columns, Eigen::Index stops, double speeds)
      : columns_(columns), speeds_(speeds) {
    largest_ = columns.middleCols(kStaticColumns, stops).cwiseAbs().colwise().maxCoeff();
  }

  [[nodiscard]] int number_of(Eigen::Index row) const {
    int number = static_cast<int>(std::floor(columns_(row, 1) / (2.0 * kInputStep)));
    if (speeds_ > 0.0) number = kSpeeds * number + speed_level(row);
    for (Eigen::Index k = 0; k < largest_.size(); ++k) {
      const double level =
          largest_(k) > 0.0 ? columns_(row, kStaticColumns + k) / largest_(k) : 0.0;
      number = kLevels * number + static_cast<int>(std::round(0.5 * (kLevels - 1) * level));
    }
    return number;
  }

  /// By steps of a factor of what the input moves in ten samples.
  [[nodiscard]] int speed_level(Eigen::Index row) const {
    constexpr Eigen::Index kReach = 5;
    constexpr double kSlowest = 0.005;
    const Eigen::Index before = std::max<Eigen::Index>(row - kReach, 0);
    const Eigen::Index after = std::min(row + kReach, columns_.rows() - 1);
    const double moved = std::abs(columns_(after, 1) - columns_(before, 1));
    return moved < kSlowest ? 0
                            : 1 + static_cast<int>(std::log(moved / kSlowest) / std::log(speeds_));
  }

 private:
  static constexpr int kLevels = 5;  ///< to which a stop operator is rounded
  static constexpr int kSpeeds = 32;

  const Eigen::MatrixXd& columns_;
  double speeds_;
  Eigen::RowVectorXd largest_;
};

/// A line c + d z by which values differ.
struct Difference {
  double offset = 0.0;
  double slope = 0.0;
};

/// What one course over time (0 early, 1 late) of offset and slope explains of a rest.
struct Explained {
  double share = 1.0;  ///< share of the variance of the rest that remains
  Difference late_minus_early = {};
};

class Course {
 public:
  Course(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target)
      : columns_(columns),
        z_(columns.col(1)),
        rest_(columns_.residual(target)),
        unexplained_(share_of_variance(rest_, target)) {}

  /// Share of the variance of the target that a fit without a change leaves.
  [[nodiscard]] double unexplained() const { return unexplained_; }

  /// Square sum that remains of the rest with columns whose coefficients are not negative, as a share of it.
  [[nodiscard]] double left_by(const Eigen::MatrixXd& others) const {
    const Eigen::Index count = others.cols();
    Eigen::MatrixXd extra(rest_.size(), count);
    for (Eigen::Index k = 0; k < count; ++k) extra.col(k) = columns_.residual(others.col(k));
    NormalEquations equations(static_cast<std::size_t>(count));
    const Eigen::MatrixXd product = extra.transpose() * extra;
    const Eigen::VectorXd projection = extra.transpose() * rest_;
    equations.product.values.assign(product.data(), product.data() + product.size());
    equations.projection.assign(projection.begin(), projection.end());
    equations.square = rest_.squaredNorm();
    if (!(equations.square > 0.0)) return 1.0;
    const std::vector<std::uint8_t> is_free(static_cast<std::size_t>(count), 0);
    return equations.error(non_negative_least_squares(equations, is_free).coefficients) /
           equations.square;
  }

  [[nodiscard]] Explained explained_by(const Eigen::VectorXd& course) const {
    Eigen::MatrixXd extra(rest_.size(), 2);
    extra << columns_.residual(course), columns_.residual(course.cwiseProduct(z_));
    const Eigen::Matrix2d normal = extra.transpose() * extra;
    const Eigen::Vector2d moment = extra.transpose() * rest_;
    const double determinant = normal.determinant();
    if (!(determinant > 1e-9 * normal(0, 0) * normal(1, 1))) return {};
    const Eigen::Vector2d solution = normal.inverse() * moment;
    const double all = rest_.squaredNorm();
    if (!(all > 0.0)) return {};
    return {std::max(0.0, 1.0 - solution.dot(moment) / all), {solution(0), solution(1)}};
  }

 private:
  FixedColumns columns_;
  Eigen::VectorXd z_;
  Eigen::VectorXd rest_;
  double unexplained_ = 1.0;
};

/// Whether the input moves most of the time: a spring that rests relaxes as a sensor settles.
bool is_moving(const Eigen::MatrixXd& columns) {
  const EqualMotion motion(columns, 0, kSpeedsOfAMotion);
  Eigen::Index moving = 0;
  for (Eigen::Index row = 0; row < columns.rows(); ++row)
    if (motion.speed_level(row) > 0) ++moving;
  return 2 * moving > columns.rows();
}

/// The course that explains most, and where it steps.
struct Candidate {
  Explained explained = {};
  Eigen::VectorXd course = {};
  std::optional<Eigen::Index> split = {};  ///< first row of the late part; empty: gradual
};

/// A trend, warm-ups, and steps with a motion that reverses before and after.
Candidate best_candidate(const Course& course, const Eigen::MatrixXd& columns,
                         const Eigen::VectorXd& target) {
  const Eigen::Index size = target.size();
  Candidate best;
  const auto take = [&](const Eigen::VectorXd& values, std::optional<Eigen::Index> split) {
    const Explained explained = course.explained_by(values);
    if (best.course.size() == 0 || explained.share < best.explained.share)
      best = {explained, values, split};
  };
  const Eigen::VectorXd trend = Eigen::VectorXd::LinSpaced(size, 0.0, 1.0);
  take(trend, {});
  if (is_moving(columns))
    for (const double settling : kSettlings) take(1.0 - (-trend.array() / settling).exp(), {});
  const Pair moved{{columns.col(1).begin(), columns.col(1).end()}, {target.begin(), target.end()}};
  const std::pair<Extent, Extent> all = known_extents(moved);
  for (std::size_t k = 1; k < kCandidates; ++k) {
    const auto split = size * static_cast<Eigen::Index>(k) / static_cast<Eigen::Index>(kCandidates);
    if (!is_excited(moved, all, 0, split) || !is_excited(moved, all, split, size)) continue;
    Eigen::VectorXd step = Eigen::VectorXd::Ones(size);
    step.head(split).setZero();
    take(step, split);
  }
  return best;
}

/// End minus beginning of the course of a candidate, of the target at equal input after equal motion; empty if too little of
/// the range is met early and late.
/// @param slope of the target over z, by which unequal inputs are compared
std::optional<Difference> compare_at_equal_motion(const Eigen::MatrixXd& columns,
                                                  const Eigen::VectorXd& target, double slope,
                                                  const Candidate& candidate) {
  // A course is compared between its first and its last third, and then extended to all of it.
  const Eigen::Index third = target.size() / 3;
  const Eigen::Index early_end = candidate.split.value_or(third);
  const Eigen::Index late_begin = candidate.split.value_or(target.size() - third);
  const double passed =
      candidate.split ? 1.0
                      : candidate.course.tail(third).mean() - candidate.course.head(third).mean();
  struct Group {
    double count = 0.0, z = 0.0, target = 0.0;
    void add(double z_of_sample, double value) { count += 1.0, z += z_of_sample, target += value; }
  };
  std::map<int, std::array<Group, 2>> groups;
  const EqualMotion motion(columns, columns.cols() - kStaticColumns, kAnySpeed);
  for (Eigen::Index i = 0; i < target.size(); ++i)
    if (i < early_end || i >= late_begin)
      groups[motion.number_of(i)][i < early_end ? 0 : 1].add(columns(i, 1), target(i));
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  std::set<int> steps;  // equal inputs, met early and late
  for (const auto& [number, pair] : groups) {
    const auto& [early, late] = pair;
    if (!(early.count > 0.0 && late.count > 0.0)) continue;
    const double z = 0.5 * (early.z / early.count + late.z / late.count);
    const double difference = late.target / late.count - early.target / early.count -
                              slope * (late.z / late.count - early.z / early.count);
    const Eigen::Vector2d row(1.0, z);
    const double weight = early.count * late.count / (early.count + late.count);
    normal += weight * row * row.transpose();
    moment += weight * difference * row;
    steps.insert(static_cast<int>(std::floor(z / (2.0 * kInputStep))));
  }
  if (kInputStep * static_cast<double>(steps.size()) < kPartShare) return {};
  const Eigen::Vector2d line = normal.ldlt().solve(moment);
  return Difference{line(0) / passed, line(1) / passed};
}

double range_of(const Eigen::VectorXd& values) { return values.maxCoeff() - values.minCoeff(); }

/// The range of the target outside of a part at equal inputs and speeds; 0 if it is as in the part for half of the samples
/// or more, or if less than a third of the part has something to compare with.
/// @param clear from this difference on a target is another one
double passed_elsewhere(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target,
                        Eigen::Index begin, Eigen::Index end, double clear) {
  constexpr Eigen::Index kNoStops = 0;
  const EqualMotion motion(columns, kNoStops, kSpeedsOfAMotion);
  std::map<int, std::pair<double, double>> elsewhere;  // sum and count
  for (Eigen::Index i = 0; i < target.size(); ++i) {
    if (i >= begin && i < end) continue;
    auto& [sum, count] = elsewhere[motion.number_of(i)];
    sum += target(i), count += 1.0;
  }
  const double in_part = target.segment(begin, end - begin).mean();
  Extent means;
  Eigen::Index compared = 0;
  Eigen::Index others = 0;
  for (Eigen::Index i = begin; i < end; ++i) {
    const auto equal = elsewhere.find(motion.number_of(i));
    if (equal == elsewhere.end()) continue;
    const double mean = equal->second.first / equal->second.second;
    means.include(mean);
    ++compared;
    if (std::abs(mean - in_part) >= clear) ++others;
  }
  return 3 * compared >= end - begin && 2 * others > compared ? means.width() : 0.0;
}

}  // namespace

std::optional<RelationChange> find_relation_change(const Pair& pair, double sample_rate_Hz) {
  const std::size_t reversals = count_reversals(pair.input);
  if (correlation(pair.input, pair.target) < kClearCorrelation || reversals < kFewestReversals)
    return {};
  const std::vector<std::size_t> samples = known_samples(pair);
  if (samples.size() < kFewestSamples) return {};
  const Eigen::MatrixXd columns = hysteresis_columns(pair.input, samples);
  const Eigen::VectorXd target = at_samples(pair.target, samples);
  const Course course(with_loaded_stops(columns), target);
  const Candidate best = best_candidate(course, columns, target);
  // A motion that hardly repeats has another torque on each stroke: then the rest must vanish.
  const double rest = best.explained.share * course.unexplained();
  if (best.explained.share > kChangeLeaves ||
      (rest > kSmallTorqueRest && reversals < kManyReversals))
    return {};
  const double slope = slope_over(columns.col(1), target);
  auto difference = compare_at_equal_motion(columns, target, slope, best);
  if (!difference) {
    // Then a friction that depends on the load explains small differences as well.
    if ((1.0 - best.explained.share) * course.unexplained() < kSmallTorqueRest) return {};
    difference = best.explained.late_minus_early;
  }
  RelationChange change{.is_gradual = !best.split,
                        .sample = best.split ? samples[static_cast<std::size_t>(*best.split)] : 0,
                        .offset = difference->offset};
  // The slope without a change is the mean of early and late, each as long as it lasts.
  const double early = slope - best.course.mean() * difference->slope;
  const double late = early + difference->slope;
  change.slope_ratio = early > 0.0 && late > 0.0 ? late / early : 1.0;
  const double by_slope = std::abs(change.slope_ratio - 1.0) / kSlopeChange;
  const double by_offset =
      std::abs(change.offset) / (kOffsetShare * extent_of(pair.target).width());
  change.is_of_slope = by_slope > by_offset;
  if (std::max(by_slope, by_offset) < 1.0) return {};
  if (change.is_of_slope && course.left_by(relaxation_columns(
                                pair.input, samples, sample_rate_Hz)) <= best.explained.share)
    return {};
  return change;
}

std::optional<SwitchedOff> find_switched_off(const Pair& pair) {
  if (std::abs(correlation(pair.input, pair.target)) < kClearCorrelation) return {};
  const std::vector<std::size_t> samples = known_samples(pair);
  if (samples.size() < kFewestSamples) return {};
  const Eigen::MatrixXd columns = hysteresis_columns(pair.input, samples);
  const Eigen::VectorXd target = at_samples(pair.target, samples);
  const Eigen::VectorXd curve = target - FixedColumns(columns).residual(target);
  const double range = extent_of(pair.target).width();
  const auto size = static_cast<std::size_t>(target.size());
  const auto begin_of = [&](std::size_t part) { return size * part / kOffParts; };
  const auto range_in = [&](const Eigen::VectorXd& values, std::size_t part) {
    const auto begin = static_cast<Eigen::Index>(begin_of(part));
    return range_of(values.segment(begin, static_cast<Eigen::Index>(begin_of(part + 1)) - begin));
  };
  struct Part {
    double expected = 0.0;
    bool is_off = false;
  };
  std::array<Part, kOffParts> parts;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    parts[k].expected = range_in(curve, k);
    parts[k].is_off = parts[k].expected >= kOffExpected * range &&
                      range_in(target, k) <= kOffPassed * parts[k].expected;
  }
  const auto* const first = std::ranges::find(parts, true, &Part::is_off);
  if (first == parts.end()) return {};
  // As far as the target remains as quiet, also where the motion turns.
  SwitchedOff off;
  auto begin = static_cast<std::size_t>(first - parts.begin());
  std::size_t end = begin + 1;
  const auto is_quiet = [&](std::size_t part) {
    return range_in(target, part) <= kOffPassed * first->expected;
  };
  while (begin > 0 && is_quiet(begin - 1)) --begin;
  while (end < kOffParts && is_quiet(end)) ++end;
  const auto off_elsewhere = std::any_of(parts.begin() + static_cast<std::ptrdiff_t>(end),
                                         parts.end(), [](const Part& part) { return part.is_off; });
  if (end - begin > kMaxOff || off_elsewhere) return {};
  const auto begin_row = static_cast<Eigen::Index>(begin_of(begin));
  const auto end_row = static_cast<Eigen::Index>(begin_of(end));
  off.passed = range_of(target.segment(begin_row, end_row - begin_row));
  off.expected = passed_elsewhere(columns, target, begin_row, end_row, kOffPassed * range);
  if (!(off.expected >= kOffExpected * range && off.passed <= kOffPassed * off.expected)) return {};
  off.samples = {.begin = samples[begin_of(begin)],
                 .end = end < kOffParts ? samples[begin_of(end)] : pair.target.size()};
  return off;
}

}  // namespace torsio
