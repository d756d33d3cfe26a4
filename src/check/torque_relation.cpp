#include "check/torque_relation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "check/hysteresis_fit.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kStrongCorrelation = 0.8;
constexpr double kShortestPart = 0.05;  ///< share of the recording
constexpr double kFlipShare = 0.05;     ///< share of the ranges that each part passes through
constexpr double kFlipCodes = 5.0;
constexpr std::size_t kCandidates = 80;
constexpr std::size_t kFewestReversals = 2;
constexpr double kChangeLeaves = 0.25;  ///< share of what is unexplained without the change
constexpr double kOffsetShare = 0.05;   ///< share of the torque's range
constexpr double kSlopeChange = 0.12;
constexpr double kSmallTorqueRest = 0.01;  ///< share of the torque's variance
constexpr std::size_t kManyReversals = 5;
constexpr std::size_t kOffParts = 20;  ///< parts of a recording that are looked at
constexpr std::size_t kMaxOff = 6;     ///< parts
constexpr double kOffExpected = 0.2;   ///< share of the target's range
constexpr double kOffPassed = 0.1;     ///< share of what is expected
constexpr double kTakenOut = 0.9;      ///< share of what the curve leaves
constexpr double kPartShare = 0.2;     ///< share of the input's range that each part passes through

/// Running sums of one part of a record.
struct Sums {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  void add(double a, double b) { n += 1.0, x += a, y += b, xx += a * a, xy += a * b, yy += b * b; }
  [[nodiscard]] Sums without(const Sums& part) const {
    return {n - part.n, x - part.x, y - part.y, xx - part.xx, xy - part.xy, yy - part.yy};
  }
  [[nodiscard]] double covariance() const { return n > 0.0 ? xy - x * y / n : 0.0; }
  [[nodiscard]] double correlation() const {
    const double spread = (n * xx - x * x) * (n * yy - y * y);
    return spread > 0.0 ? (n * xy - x * y) / std::sqrt(spread) : 0.0;
  }
};

bool is_known(const Pair& pair, std::size_t i) {
  return is_finite(pair.input[i]) && is_finite(pair.target[i]);
}

void include_known(Extent& extent, const Pair& pair) {
  for (std::size_t i = 0; i < pair.input.size(); ++i)
    if (is_known(pair, i)) extent.include(pair.input[i]);
}

/// With a friction that depends on the load: the stops times the scaled input. Without them its two branches would be
/// two slopes, one early and one late.
Eigen::MatrixXd with_loaded_stops(const Eigen::MatrixXd& columns) {
  const Eigen::Index stops = columns.cols() - kStaticColumns;
  Eigen::MatrixXd all(columns.rows(), columns.cols() + stops);
  all << columns, columns.rightCols(stops).array().colwise() * columns.col(1).array();
  return all;
}

/// Extents of input and target in [begin, end).
std::pair<double, double> passed(const Pair& pair, std::size_t begin, std::size_t end) {
  Extent input;
  Extent target;
  for (std::size_t i = begin; i < end; ++i)
    if (is_known(pair, i)) input.include(pair.input[i]), target.include(pair.target[i]);
  return {input.width(), target.width()};
}

/// Whether input and target pass through a good part of their ranges in [begin, end), and the input
/// reverses there.
bool is_excited(const Pair& pair, std::size_t begin, std::size_t end, double input_width,
                double target_width) {
  const auto [input, target] = passed(pair, begin, end);
  if (!(input > kPartShare * input_width && target > kPartShare * target_width)) return false;
  return count_reversals(std::span(pair.input).subspan(begin, end - begin), 1) > 0;
}

/// What one course over time (0 early, 1 late) of offset and slope explains of a rest.
struct Explained {
  double share = 1.0;  ///< share of the variance of the rest that remains
  double offset = 0.0;
  double slope = 0.0;  ///< per unit of the scaled input
  double mean = 0.0;   ///< mean value of the course
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
    return {std::max(0.0, 1.0 - solution.dot(moment) / all), solution(0), solution(1),
            course.mean()};
  }

 private:
  FixedColumns columns_;
  Eigen::VectorXd z_;
  Eigen::VectorXd rest_;
  double unexplained_ = 1.0;
};

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The terms z, x z and z^2 of other inputs z over the first input x.
class OtherTerms {
 public:
  OtherTerms(std::span<const Pair> pairs, std::span<const OtherInput> others)
      : pairs_(pairs), others_(others) {
    for (const Pair& pair : pairs) include_known(extent_, pair);
    for (const OtherInput& other : others) {
      Extent range;
      std::set<double> levels;
      for (const std::vector<double>& values : other.values)
        for (const double value : values) {
          range.include(value);
          if (is_finite(value) && levels.size() < kFewestLevels) levels.insert(value);
        }
      ranges_.push_back({range, levels.size() >= kFewestLevels});
    }
  }

  [[nodiscard]] Eigen::Index count() const { return 3 * static_cast<Eigen::Index>(others_.size()); }
  /// Range of the first input over all recordings.
  [[nodiscard]] const Extent& extent() const { return extent_; }

  void put(Eigen::RowVectorXd& row, std::size_t recording, std::size_t sample) const {
    const double middle = 0.5 * (extent_.lowest + extent_.highest);
    const double scale = extent_.width() > 0.0 ? 2.0 / extent_.width() : 0.0;
    const double x = scale * (pairs_[recording].input[sample] - middle);
    for (std::size_t k = 0; k < others_.size(); ++k) {
      const auto& [range, has_square] = ranges_[k];
      const double z = range.width() > 0.0
                           ? (others_[k].values[recording][sample] - range.lowest) / range.width()
                           : 0.0;
      const auto first = static_cast<Eigen::Index>(3 * k);
      row(first) = z;
      row(first + 1) = x * z;
      row(first + 2) = has_square ? z * z : 0.0;
    }
  }

 private:
  std::span<const Pair> pairs_;
  std::span<const OtherInput> others_;
  Extent extent_;
  std::vector<std::pair<Extent, bool>> ranges_;  ///< and whether there is a square
};

/// Slope of the target over z, by least squares.
double slope_over(const Eigen::VectorXd& z, const Eigen::VectorXd& target) {
  const Eigen::VectorXd varying = z.array() - z.mean();
  const double variance = varying.squaredNorm();
  return variance > 0.0 ? varying.dot(target) / variance : 0.0;
}

}  // namespace

std::optional<SignFlip> find_sign_flip(const Pair& pair, double input_code, double target_code) {
  Sums whole;
  for (std::size_t i = 0; i < pair.input.size(); ++i)
    if (is_known(pair, i)) whole.add(pair.input[i], pair.target[i]);
  Sums before;
  Sums best;
  SignFlip flip;
  double strongest = 0.0;
  for (std::size_t i = 0; i < pair.input.size(); ++i) {
    if (!is_known(pair, i)) continue;
    const double contrast = std::abs(before.covariance() - whole.without(before).covariance());
    if (before.n > kShortestPart * whole.n && before.n < (1.0 - kShortestPart) * whole.n &&
        contrast > strongest)
      strongest = contrast, flip.sample = i, best = before;
    before.add(pair.input[i], pair.target[i]);
  }
  flip.before = best.correlation();
  flip.after = whole.without(best).correlation();
  const bool turns = std::min(flip.before, flip.after) < -kStrongCorrelation &&
                     std::max(flip.before, flip.after) > kStrongCorrelation;
  if (!turns) return {};
  const double input_least =
      std::max(kFlipShare * extent_of(pair.input).width(), kFlipCodes * input_code);
  const double target_least =
      std::max(kFlipShare * extent_of(pair.target).width(), kFlipCodes * target_code);
  for (const auto& [begin, end] :
       {std::pair<std::size_t, std::size_t>{0, flip.sample}, {flip.sample, pair.input.size()}}) {
    const auto [input, target] = passed(pair, begin, end);
    if (!(input >= input_least) || !(target >= target_least)) return {};
  }
  return flip;
}

std::optional<RelationChange> find_relation_change(const Pair& pair) {
  const std::size_t reversals = count_reversals(pair.input);
  if (correlation(pair.input, pair.target) < kClearCorrelation || reversals < kFewestReversals)
    return {};
  const std::vector<std::size_t> samples = known_samples(pair);
  if (samples.size() < kFewestSamples) return {};
  const Eigen::MatrixXd columns = hysteresis_columns(pair.input, samples);
  const Eigen::VectorXd target = at_samples(pair.target, samples);
  const Course course(with_loaded_stops(columns), target);
  Pair coarse;
  for (const std::size_t i : samples)
    coarse.input.push_back(pair.input[i]), coarse.target.push_back(pair.target[i]);
  const std::size_t size = coarse.input.size();
  const auto [input_width, target_width] = passed(coarse, 0, size);
  Eigen::VectorXd late(target.size());
  for (Eigen::Index i = 0; i < late.size(); ++i)
    late(i) = static_cast<double>(i) / static_cast<double>(late.size());
  Explained best = course.explained_by(late);
  RelationChange change{.is_gradual = true};
  for (std::size_t k = 1; k < kCandidates; ++k) {
    const std::size_t split = size * k / kCandidates;
    if (!is_excited(coarse, 0, split, input_width, target_width) ||
        !is_excited(coarse, split, size, input_width, target_width))
      continue;
    for (Eigen::Index i = 0; i < late.size(); ++i)
      late(i) = i < static_cast<Eigen::Index>(split) ? 0.0 : 1.0;
    const Explained explained = course.explained_by(late);
    if (explained.share < best.share)
      best = explained, change = {.is_gradual = false, .sample = samples[split]};
  }
  // A motion that hardly repeats has another torque on each stroke: then the rest must vanish.
  const double rest = best.share * course.unexplained();
  if (best.share > kChangeLeaves || (rest > kSmallTorqueRest && reversals < kManyReversals))
    return {};
  change.offset = best.offset;
  // The slope without a change is the mean of early and late, each as long as it lasts.
  const double early = slope_over(columns.col(1), target) - best.mean * best.slope;
  const double late_slope = early + best.slope;
  change.slope_ratio = early > 0.0 && late_slope > 0.0 ? late_slope / early : 1.0;
  const double by_slope = std::abs(change.slope_ratio - 1.0) / kSlopeChange;
  const double by_offset =
      std::abs(change.offset) / (kOffsetShare * extent_of(pair.target).width());
  change.is_of_slope = by_slope > by_offset;
  return std::max(by_slope, by_offset) >= 1.0 ? std::optional(change) : std::nullopt;
}

std::vector<RecordLine> compare_records(const std::vector<const Pair*>& pairs) {
  Extent extent;
  for (const Pair* pair : pairs) include_known(extent, *pair);
  std::vector<Eigen::MatrixXd> parts;
  std::vector<Eigen::VectorXd> targets;
  Eigen::Index rows = 0;
  for (const Pair* pair : pairs) {
    const auto samples = known_samples(*pair, kSamplesOfAFit / pairs.size());
    if (samples.size() < kFewestSamples) return {};
    parts.push_back(hysteresis_columns(pair->input, samples, extent));
    targets.push_back(at_samples(pair->target, samples));
    rows += parts.back().rows();
  }
  const Eigen::Index common = parts.front().cols();
  const auto records = static_cast<Eigen::Index>(pairs.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows, common + 2 * (records - 1));
  Eigen::VectorXd target(rows);
  Eigen::Index row = 0;
  for (Eigen::Index r = 0; r < records; ++r) {
    const Eigen::MatrixXd& part = parts[static_cast<std::size_t>(r)];
    columns.block(row, 0, part.rows(), common) = part;
    if (r > 0) columns.block(row, common + 2 * (r - 1), part.rows(), 2) = part.leftCols(2);
    target.segment(row, part.rows()) = targets[static_cast<std::size_t>(r)];
    row += part.rows();
  }
  const Eigen::VectorXd solution =
      (columns.transpose() * columns).ldlt().solve(columns.transpose() * target);
  const double with_lines = share_of_variance(target - columns * solution, target);
  const double without_lines = FixedColumns(columns.leftCols(common)).unexplained(target);
  std::vector<double> offsets{0.0};
  std::vector<double> slopes{0.0};
  for (Eigen::Index r = 0; r + 1 < records; ++r) {
    offsets.push_back(solution(common + 2 * r));
    slopes.push_back(solution(common + 2 * r + 1));
  }
  const double usual_offset = median_of(offsets);
  const double usual_slope = median_of(slopes);
  const double slope = slope_over(columns.col(1), target);
  std::vector<RecordLine> lines;
  for (std::size_t r = 0; r < pairs.size(); ++r)
    lines.push_back(
        {.offset = offsets[r] - usual_offset + (slopes[r] - usual_slope) * parts[r].col(1).mean(),
         .slope = slope != 0.0 ? 1.0 + (slopes[r] - usual_slope) / slope : 1.0,
         .unexplained = with_lines,
         .without_lines = without_lines});
  return lines;
}

std::optional<SwitchedOff> find_switched_off(const Pair& pair) {
  if (std::abs(correlation(pair.input, pair.target)) < kClearCorrelation) return {};
  const std::vector<std::size_t> samples = known_samples(pair);
  if (samples.size() < kFewestSamples) return {};
  const FixedColumns columns(hysteresis_columns(pair.input, samples));
  const Eigen::VectorXd target = at_samples(pair.target, samples);
  const Eigen::VectorXd curve = target - columns.residual(target);
  const double range = extent_of(pair.target).width();
  struct Part {
    double expected = 0.0;
    double passed = 0.0;
    bool is_off = false;
  };
  std::array<Part, kOffParts> parts;
  const auto size = static_cast<std::size_t>(target.size());
  const auto begin_of = [&](std::size_t part) { return size * part / kOffParts; };
  for (std::size_t k = 0; k < kOffParts; ++k) {
    const auto width = [&](const Eigen::VectorXd& values) {
      const auto of_part = values.segment(static_cast<Eigen::Index>(begin_of(k)),
                                          static_cast<Eigen::Index>(begin_of(k + 1) - begin_of(k)));
      return of_part.maxCoeff() - of_part.minCoeff();
    };
    parts[k] = {.expected = width(curve), .passed = width(target)};
    parts[k].is_off = parts[k].expected >= kOffExpected * range &&
                      parts[k].passed <= kOffPassed * parts[k].expected;
  }
  const auto first = std::ranges::find(parts, true, &Part::is_off);
  if (first == parts.end()) return {};
  // As far as the target remains as quiet, also where the motion turns.
  SwitchedOff off{.samples = {}, .passed = first->passed, .expected = first->expected};
  std::size_t begin = static_cast<std::size_t>(first - parts.begin());
  std::size_t end = begin + 1;
  const auto is_quiet = [&](const Part& part) {
    return part.passed <= kOffPassed * first->expected;
  };
  while (begin > 0 && is_quiet(parts[begin - 1])) --begin;
  while (end < kOffParts && is_quiet(parts[end])) ++end;
  const auto off_elsewhere = std::ranges::any_of(parts.begin() + static_cast<std::ptrdiff_t>(end),
                                                 parts.end(), &Part::is_off);
  if (end - begin > kMaxOff || off_elsewhere) return {};
  for (std::size_t k = begin; k < end; ++k) {
    off.passed = std::max(off.passed, parts[k].passed);
    off.expected = std::max(off.expected, parts[k].expected);
  }
  off.samples = {.begin = samples[begin_of(begin)],
                 .end = end < kOffParts ? samples[begin_of(end)] : pair.target.size()};
  return off;
}

void take_out(std::span<Pair> pairs, std::span<const OtherInput> others) {
  const OtherTerms terms(pairs, others);
  Eigen::RowVectorXd of_sample(terms.count());
  std::vector<std::vector<std::size_t>> samples;
  Eigen::Index rows = 0;
  for (std::size_t r = 0; r < pairs.size(); ++r) {
    Pair usable = pairs[r];
    for (std::size_t i = 0; i < usable.input.size(); ++i) {
      terms.put(of_sample, r, i);
      if (!of_sample.allFinite()) usable.input[i] = kNotMeasured;
    }
    samples.push_back(
        known_samples(usable, std::max(kSamplesOfAFit / pairs.size(), kFewestSamples)));
    rows += static_cast<Eigen::Index>(samples.back().size());
  }
  if (rows < static_cast<Eigen::Index>(kFewestSamples)) return;
  Eigen::MatrixXd curve;
  Eigen::MatrixXd effect(rows, terms.count());
  Eigen::VectorXd target(rows);
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < pairs.size(); ++r) {
    const auto count = static_cast<Eigen::Index>(samples[r].size());
    const Eigen::MatrixXd part = hysteresis_columns(pairs[r].input, samples[r], terms.extent());
    if (r == 0) curve.resize(rows, part.cols());
    curve.middleRows(row, count) = part;
    target.segment(row, count) = at_samples(pairs[r].target, samples[r]);
    for (const std::size_t sample : samples[r]) {
      terms.put(of_sample, r, sample);
      effect.row(row++) = of_sample;
    }
  }
  const FixedColumns columns(curve);
  const Eigen::VectorXd rest = columns.residual(target);
  Eigen::MatrixXd beyond(rows, terms.count());
  for (Eigen::Index k = 0; k < terms.count(); ++k) beyond.col(k) = columns.residual(effect.col(k));
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(beyond);
  qr.setThreshold(1e-6);
  const Eigen::VectorXd coefficients = qr.solve(rest);
  if (!((rest - beyond * coefficients).squaredNorm() <= kTakenOut * rest.squaredNorm())) return;
  for (std::size_t r = 0; r < pairs.size(); ++r)
    for (std::size_t i = 0; i < pairs[r].target.size(); ++i) {
      terms.put(of_sample, r, i);
      if (const double explained = of_sample * coefficients; is_finite(explained))
        pairs[r].target[i] -= explained;
    }
}

std::optional<double> unexplained_share(const Pair& pair,
                                        std::span<const std::vector<double>> others) {
  Pair usable = pair;
  for (const std::vector<double>& other : others)
    for (std::size_t i = 0; i < usable.input.size(); ++i)
      if (!is_finite(other[i])) usable.input[i] = kNotMeasured;
  const std::vector<std::size_t> samples = known_samples(usable);
  if (samples.size() < kFewestSamples) return {};
  const Eigen::MatrixXd curve = hysteresis_columns(pair.input, samples);
  const auto more = static_cast<Eigen::Index>(others.size());
  Eigen::MatrixXd columns(curve.rows(), curve.cols() + 2 * more);
  columns.leftCols(curve.cols()) = curve;
  for (Eigen::Index k = 0; k < more; ++k) {
    Eigen::VectorXd values = at_samples(others[static_cast<std::size_t>(k)], samples);
    values.array() -= values.mean();
    if (const double largest = values.cwiseAbs().maxCoeff(); largest > 0.0) values /= largest;
    columns.col(curve.cols() + 2 * k) = values;
    columns.col(curve.cols() + 2 * k + 1) = values.cwiseAbs();
  }
  return FixedColumns(columns).unexplained(at_samples(pair.target, samples));
}

std::string_view unit_mistake(double ratio) {
  struct Mistake {
    double ratio;
    std::string_view name;
  };
  constexpr double kNear = 1.1;
  constexpr auto kMistakes = std::to_array<Mistake>({{57.29577951308232, "degrees and radians"},
                                                     {100.0, "Nm and Ncm"},
                                                     {1000.0, "a unit and its thousandth"},
                                                     {57295.77951308232, "degrees and mrad"},
                                                     {1e6, "a unit and its millionth"}});
  if (!(ratio > 0.0)) return {};
  const double factor = std::max(ratio, 1.0 / ratio);
  for (const Mistake& mistake : kMistakes)
    if (factor < kNear * mistake.ratio && mistake.ratio < kNear * factor) return mistake.name;
  return {};
}

}  // namespace torsio
