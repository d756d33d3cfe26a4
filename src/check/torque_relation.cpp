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
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kStrongCorrelation = 0.8;
constexpr double kShortestPart = 0.05;  ///< share of the recording
constexpr double kFlipShare = 0.05;     ///< share of the ranges that each part passes through
constexpr double kFlipCodes = 5.0;
constexpr double kTakenOut = 0.9;  ///< share of what the curve leaves

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
    for (const Pair& pair : pairs) extent_.include(known_extents(pair).first);
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
    const auto [input, target] = known_extents(pair, begin, end);

    if (!(input.width() >= input_least) || !(target.width() >= target_least)) return {};
  }
  return flip;
}

std::vector<RecordLine> compare_records(const std::vector<const Pair*>& pairs,
                                        std::span<const std::size_t> references) {
  Extent extent;
  for (const Pair* pair : pairs) extent.include(known_extents(*pair).first);
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
  const auto usual = [&](const std::vector<double>& of_records) {
    if (references.empty()) return median_of(of_records);
    std::vector<double> of_references;
    for (const std::size_t r : references) of_references.push_back(of_records[r]);
    return median_of(of_references);
  };
  const double usual_offset = usual(offsets);
  const double usual_slope = usual(slopes);
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

std::string_view unit_mistake(double ratio, bool is_angle) {
  struct Mistake {
    double ratio;
    std::string_view name;
    bool is_of_angles = true;
  };
  constexpr double kNear = 1.1;
  constexpr auto kMistakes = std::to_array<Mistake>({{57.29577951308232, "degrees and radians"},
                                                     {100.0, "Nm and Ncm", false},
                                                     {1000.0, "a unit and its thousandth"},
                                                     {57295.77951308232, "degrees and mrad"},
                                                     {1e6, "a unit and its millionth"}});
  if (!(ratio > 0.0)) return {};
  const double factor = std::max(ratio, 1.0 / ratio);
  for (const Mistake& mistake : kMistakes)
    if ((mistake.is_of_angles || !is_angle) && factor < kNear * mistake.ratio &&
        mistake.ratio < kNear * factor)
      return mistake.name;
  return {};
}

}  // namespace torsio
