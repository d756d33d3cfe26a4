#include "check/torque_faults.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "check/hysteresis_fit.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kNearLowest = 0.05;  ///< share of the range
constexpr double kOnEachSide = 0.1;   ///< share of the samples
constexpr double kFoldedTogether = 0.95;
constexpr double kNotTogether = 0.7;
constexpr double kZoneOverNoise = 8.0;
constexpr double kLeastZone = 0.005;  ///< share of the range
constexpr double kHiddenShare = 0.05;
constexpr double kHiddenOverZone = 5.0;
constexpr std::size_t kFewestVisits = 3;
constexpr double kAway = 0.2;            ///< share of the range between two visits
constexpr double kOnPlateau = 0.3;       ///< share of the samples
constexpr double kBeyondPlateau = 2e-3;  ///< share of the samples
constexpr double kWidestZone = 0.1;      ///< share of the range
constexpr double kMovesOnPlateau = 0.3;  ///< share of the input's range
constexpr std::size_t kFewestStrokes = 5;
constexpr double kLeastAngle_rad = 1.0;
constexpr double kLeastUnexplained = 1e-4;
constexpr double kPositionLeaves = 0.35;
constexpr double kPositionHeldOut = 0.6;
constexpr double kOverRatio = 0.5;     ///< share of what q itself leaves
constexpr double kOwnVariation = 0.1;  ///< share of its variance that the input does not explain
constexpr std::size_t kPositionParts = 4;

/// What the columns leave of a residual, in all and in parts that are not used for the fit, as shares of it.
struct Left {
  double share = 1.0;
  double held_out = 1.0;
  Eigen::VectorXd coefficients;
};
Left left_by(const Eigen::MatrixXd& columns, const Eigen::VectorXd& rest) {
  const double all = rest.squaredNorm();
  Left left{
      .share = 1.0, .held_out = 1.0, .coefficients = columns.colPivHouseholderQr().solve(rest)};
  if (!(all > 0.0)) return left;
  left.share = (rest - columns * left.coefficients).squaredNorm() / all;
  double held_out = 0.0;
  const Eigen::Index rows = rest.size();
  for (std::size_t p = 0; p < kPositionParts; ++p) {
    const auto begin =
        rows * static_cast<Eigen::Index>(p) / static_cast<Eigen::Index>(kPositionParts);
    const auto end =
        rows * static_cast<Eigen::Index>(p + 1) / static_cast<Eigen::Index>(kPositionParts);
    Eigen::MatrixXd others = columns;
    Eigen::VectorXd target = rest;
    others.middleRows(begin, end - begin).setZero();
    target.segment(begin, end - begin).setZero();
    const Eigen::VectorXd fitted = others.colPivHouseholderQr().solve(target);
    held_out += (rest.segment(begin, end - begin) - columns.middleRows(begin, end - begin) * fitted)
                    .squaredNorm();
  }
  left.held_out = held_out / all;
  return left;
}

/// Visits of a zone at one end of the target, during which the input continues outwards.
/// @param sign 1: the highest values, -1: the lowest ones
Limit limit_at(const Pair& pair, const Extent& target, double sign, double zone, double slope,
               double least_hidden) {
  const double end_of_range = sign > 0.0 ? target.highest : -target.lowest;
  Limit limit;
  limit.level = sign * (end_of_range - 0.5 * zone);
  bool has_left = true;  // a visit that noise divides is one
  const auto is_inside = [&](std::size_t i) {
    return is_known(pair, i) && sign * pair.target[i] >= end_of_range - zone;
  };
  for (std::size_t begin = 0, end = 0; begin < pair.target.size(); begin = end) {
    end = begin + 1;
    if (is_known(pair, begin) && sign * pair.target[begin] < end_of_range - kAway * target.width())
      has_left = true;
    if (!is_inside(begin)) continue;
    while (end < pair.target.size() && is_inside(end)) ++end;
    double farthest = 0.0;
    for (std::size_t i = begin; i < end; ++i)
      farthest = std::max(farthest, sign * slope * (pair.input[i] - pair.input[begin]));
    if (!(farthest >= least_hidden)) continue;
    if (has_left) ++limit.visits;
    has_left = false;
    limit.hidden = std::max(limit.hidden, farthest);
    limit.samples.push_back({begin, end});
  }
  return limit;
}

}  // namespace

std::optional<LostSign> find_lost_sign(const Pair& pair) {
  const auto [input, target] = known_extents(pair);
  if (!(target.width() > 0.0) || std::abs(correlation(pair.input, pair.target)) > kNotTogether)
    return {};
  const double sign = target.lowest + target.highest >= 0.0 ? 1.0 : -1.0;
  const double lowest = sign > 0.0 ? target.lowest : -target.highest;
  if (std::abs(lowest) > kNearLowest * target.width()) return {};
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < pair.target.size(); ++i)
    if (is_known(pair, i) && sign * pair.target[i] < lowest + kNearLowest * target.width())
      sum += pair.input[i], count += 1.0;
  LostSign lost{.input = sum / count};
  std::vector<double> distance(pair.input.size());
  double known = 0.0;
  double above = 0.0;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    distance[i] = std::abs(pair.input[i] - lost.input);
    if (!is_known(pair, i)) continue;
    known += 1.0;
    if (pair.input[i] > lost.input) above += 1.0;
  }
  lost.together = sign * correlation(distance, pair.target);
  if (!(lost.together >= kFoldedTogether) || std::min(above, known - above) < kOnEachSide * known)
    return {};
  return lost;
}

std::optional<Plateau> find_plateau(const Pair& pair, double noise) {
  const double input_width = known_extents(pair).first.width();
  std::vector<double> sorted;
  std::ranges::copy_if(pair.target, std::back_inserter(sorted),
                       [](double value) { return is_finite(value); });
  if (sorted.empty() || !(input_width > 0.0)) return {};
  std::ranges::sort(sorted);
  // Not the extremes themselves, which a single wrong value may be.
  const auto beyond = static_cast<std::size_t>(kBeyondPlateau * static_cast<double>(sorted.size()));
  const double lowest = sorted[beyond];
  const double highest = sorted[sorted.size() - 1 - beyond];
  const double zone = std::max(kZoneOverNoise * noise, kLeastZone * (highest - lowest));
  if (!(zone < kWidestZone * (highest - lowest))) return {};
  Plateau plateau;
  plateau.input_share = 1.0;
  for (const double end : {lowest, highest}) {
    const auto is_there = [&](std::size_t n) { return std::abs(pair.target[n] - end) <= zone; };
    Extent moved;
    std::size_t there = 0;
    for (std::size_t n = 0; n < pair.target.size(); ++n) {
      if (!is_there(n)) continue;
      const std::size_t begin = n;
      for (; n < pair.target.size() && is_there(n); ++n) moved.include(pair.input[n]);
      plateau.samples.push_back({begin, n});
      there += n - begin;
    }
    const double share = static_cast<double>(there) / static_cast<double>(sorted.size());
    if (share >= kOnEachSide) {
      plateau.input_share = std::min(plateau.input_share, moved.width() / input_width);
      plateau.levels.push_back(end);
    }
    plateau.share += share;
  }
  plateau.is_at_zero = plateau.levels.size() == 1 && std::abs(plateau.levels.front()) <= zone;
  const bool is_found = plateau.share >= kOnPlateau && plateau.input_share >= kMovesOnPlateau;
  return is_found ? std::optional(plateau) : std::nullopt;
}

std::optional<Limit> find_limit(const Pair& pair, double noise) {
  const auto [input, target] = known_extents(pair);
  if (!(input.width() > 0.0 && target.width() > 0.0)) return {};
  const double together = correlation(pair.input, pair.target);
  if (std::abs(together) < kNotTogether) return {};
  const double slope = line_through(pair).slope;
  const double zone = std::max(kZoneOverNoise * noise, kLeastZone * target.width());
  const double hidden = std::max(kHiddenShare * target.width(), kHiddenOverZone * zone);
  Limit best;
  std::size_t visits = 0;
  for (const double sign : {1.0, -1.0}) {
    Limit limit = limit_at(pair, target, sign, zone, slope, hidden);
    visits += limit.visits;
    if (limit.visits > best.visits) best = std::move(limit);
  }
  return visits >= kFewestVisits ? std::optional(best) : std::nullopt;
}

std::optional<PositionEffect> find_position_effect(const Pair& pair,
                                                   const std::vector<double>& angle_rad) {
  Pair usable = pair;
  Extent angle;
  for (std::size_t i = 0; i < angle_rad.size(); ++i) {
    if (!is_finite(angle_rad[i])) usable.input[i] = kNotMeasured;
    angle.include(angle_rad[i]);
  }
  // In few strokes the joint moves as the load does.
  if (!(angle.width() >= kLeastAngle_rad) || count_reversals(pair.input) < kFewestStrokes)
    return {};
  const std::vector<std::size_t> samples = known_samples(usable);
  if (samples.size() < kFewestSamples) return {};
  const FixedColumns curve(hysteresis_columns(usable.input, samples));
  const Eigen::VectorXd target = at_samples(usable.target, samples);
  const Eigen::VectorXd rest = curve.residual(target);
  PositionEffect effect{.unexplained = share_of_variance(rest, target)};
  if (!(effect.unexplained >= kLeastUnexplained)) return {};
  const Eigen::VectorXd q = at_samples(angle_rad, samples);
  const Eigen::Index harmonics = angle.width() >= std::numbers::pi ? 2 : 1;
  Eigen::MatrixXd waves(q.size(), 2 * harmonics);
  for (Eigen::Index k = 0; k < harmonics; ++k) {
    const auto order = static_cast<double>(k + 1);
    waves.col(2 * k) = (order * q.array()).sin();
    waves.col(2 * k + 1) = (order * q.array()).cos();
  }
  Eigen::MatrixXd beyond(waves.rows(), waves.cols());
  for (Eigen::Index k = 0; k < waves.cols(); ++k) beyond.col(k) = curve.residual(waves.col(k));
  const Left by_waves = left_by(beyond, rest);
  const Left by_ratio = left_by(curve.residual(q), rest);
  effect.left = by_waves.share;
  const Eigen::VectorXd course = waves * by_waves.coefficients;
  effect.amplitude = 0.5 * (course.maxCoeff() - course.minCoeff());
  // Where the joint moves with its load, the curve explains most of what the waves do.
  if (share_of_variance(beyond * by_waves.coefficients, course) < kOwnVariation) return {};
  if (!(by_waves.share <= kPositionLeaves && by_waves.held_out <= kPositionHeldOut &&
        by_waves.share <= kOverRatio * by_ratio.share))
    return {};
  return effect;
}

}  // namespace torsio
