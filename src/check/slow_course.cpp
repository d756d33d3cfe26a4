#include "check/slow_course.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "check/hysteresis_fit.hpp"
#include "check/torque_relation.hpp"
#include "numerics/reversals.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxHalfWaves = 8;
constexpr std::size_t kReversalsOfAHalfWave = 4;
constexpr std::size_t kFewestHalfWaves = 2;
constexpr double kLeastRest = 0.01;     ///< share of the target's variance
constexpr double kCourseLeaves = 0.25;  ///< share of what the curve leaves
constexpr double kCourseRange = 0.08;   ///< share of the target's range

}  // namespace

std::optional<SlowCourse> find_slow_course(const Pair& pair, double sample_rate_Hz) {
  if (std::abs(correlation(pair.input, pair.target)) < kClearCorrelation) return {};
  const std::size_t half_waves =
      std::min(kMaxHalfWaves, count_reversals(pair.input) / kReversalsOfAHalfWave);
  const std::vector<std::size_t> samples = known_samples(pair);
  if (half_waves < kFewestHalfWaves || samples.size() < kFewestSamples) return {};
  const Eigen::MatrixXd hysteresis = hysteresis_columns(pair.input, samples);
  const Eigen::MatrixXd relaxations = relaxation_columns(pair.input, samples, sample_rate_Hz);
  const Eigen::Index stops = hysteresis.cols() - kStaticColumns;
  Eigen::MatrixXd columns(hysteresis.rows(), hysteresis.cols() + stops + relaxations.cols());
  columns << hysteresis, hysteresis.rightCols(stops).array().colwise() * hysteresis.col(1).array(),
      relaxations;
  const FixedColumns curve(columns);
  const Eigen::VectorXd target = at_samples(pair.target, samples);
  const Eigen::VectorXd rest = curve.residual(target);
  SlowCourse course{.unexplained = share_of_variance(rest, target)};
  if (!(course.unexplained >= kLeastRest)) return {};
  Eigen::MatrixXd waves(rest.size(), static_cast<Eigen::Index>(half_waves));
  Eigen::MatrixXd beyond(waves.rows(), waves.cols());
  for (Eigen::Index k = 0; k < waves.cols(); ++k) {
    const double phase = std::numbers::pi * static_cast<double>(k + 1);
    waves.col(k) = Eigen::VectorXd::LinSpaced(rest.size(), 0.0, phase).array().cos();
    beyond.col(k) = curve.residual(waves.col(k));
  }
  const Eigen::VectorXd coefficients = beyond.colPivHouseholderQr().solve(rest);
  course.left = (rest - beyond * coefficients).squaredNorm() / rest.squaredNorm();
  // The relaxations are nearly functions of time as well.
  const FixedColumns without(columns.leftCols(columns.cols() - relaxations.cols()));
  for (Eigen::Index k = 0; k < waves.cols(); ++k) beyond.col(k) = without.residual(waves.col(k));
  const Eigen::VectorXd values =
      waves * beyond.colPivHouseholderQr().solve(without.residual(target));
  course.range = values.maxCoeff() - values.minCoeff();
  if (!(course.left <= kCourseLeaves &&
        course.range >= kCourseRange * extent_of(pair.target).width()))
    return {};
  return course;
}

}  // namespace torsio
