#include "identify/drive/drive_search.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/aligned_vector.hpp"
#include "core/report_progress.hpp"

namespace torsio {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// A change of a parameter that is searched for by its value, as a share of this, is as small as one of another by its
// logarithm.
double scale_of(const SearchedDriveParameter& parameter) {
  return parameter.is_positive ? 1.0 : (parameter.highest - parameter.lowest);
}

double moved(const SearchedDriveParameter& parameter, double value, double by) {
  const double next =
      parameter.is_positive ? value * std::exp(by) : value + by * scale_of(parameter);
  return std::clamp(next, parameter.lowest, parameter.highest);
}

double distance(const SearchedDriveParameter& parameter, double from, double to) {
  return parameter.is_positive ? std::log(to / from) : (to - from) / scale_of(parameter);
}

struct WeightedRun {
  const DriveLog* log;
  DriveRun run;
  double weight;  ///< weight of one sample
};

std::vector<WeightedRun> runs_of(const DriveProblem& problem, double window_s) {
  std::vector<WeightedRun> runs;
  for (std::size_t k = 0; k < problem.logs.size(); ++k) {
    const DriveLog* log = problem.logs[k];
    std::size_t length = log->size();
    if (window_s > 0.0)
      length = std::clamp<std::size_t>(
          static_cast<std::size_t>(std::lround(window_s / log->sample_period_s)), 2, log->size());
    const double weight = (problem.log_weights.empty() ? 1.0 : problem.log_weights[k]) /
                          static_cast<double>(problem.logs.size() * log->size());
    for (std::size_t first = 0; first + 2 <= log->size(); first += length)
      runs.push_back({log, run_from(*log, first, std::min(length, log->size() - first)), weight});
  }
  return runs;
}

double loss(double error, double huber) {
  const double ratio = error / huber;
  return huber * huber * (std::sqrt(1.0 + ratio * ratio) - 1.0);
}

/// The free runs of one problem at one horizon.
class Evaluation {
 public:
  Evaluation(const DriveProblem& problem, const DriveCost& cost)
      : problem_(problem), cost_(cost), runs_(runs_of(problem, cost.window_s)) {
    std::size_t longest = 0;
    for (const WeightedRun& run : runs_) longest = std::max(longest, run.run.samples);
    angles_.resize(longest * kDriveLanes);
  }

  std::array<double, kDriveLanes> costs(const DriveLanes& lanes) {
    std::array<double, kDriveLanes> sums{};
    each_sample(lanes, [&](const double* angle, double measured, double weight) {
      for (std::size_t lane = 0; lane < kDriveLanes; ++lane)
        sums[lane] += weight * loss(angle[lane] - measured, cost_.huber_rad);
    });
    for (std::size_t lane = 0; lane < kDriveLanes; ++lane) {
      for (const SearchedDriveParameter& parameter : problem_.searched)
        sums[lane] += prior(parameter, lanes.of[parameter.index][lane]);
      if (!std::isfinite(sums[lane])) sums[lane] = kInfinite;
    }
    return sums;
  }

  /// Gauss-Newton's matrix and gradient at `values`, by differences of `by` to the side that has room.
  void linearise(const DriveValues& values, double by) {
    const std::size_t count = problem_.searched.size();
    matrix =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
    gradient = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count));
    jacobians_.assign(count, {});
    // More parameters than lanes: several passes, whose columns are kept until all are there.
    for (std::size_t from = 0; from < count; from += kDriveLanes - 1) {
      const std::size_t part = std::min(count - from, kDriveLanes - 1);
      differentiate(values, by, from, part, count);
    }
    if (count > kDriveLanes - 1) multiply_columns(count);
    for (std::size_t k = 0; k < count; ++k) {
      const SearchedDriveParameter& parameter = problem_.searched[k];
      const auto at = static_cast<Eigen::Index>(k);
      matrix(at, at) += 2.0 * cost_.prior_weight;
      gradient[at] += 2.0 * cost_.prior_weight *
                      distance(parameter, parameter.typical, values[parameter.index]);
    }
  }

  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;

 private:
  template <class Visit>
  void each_sample(const DriveLanes& lanes, const Visit& visit) {
    for (const WeightedRun& run : runs_) {
      problem_.roll_out(*run.log, run.run, lanes, angles_.data());
      for (std::size_t n = 0; n < run.run.samples; ++n)
        visit(angles_.data() + n * kDriveLanes, run.log->angle_rad[run.run.first + n], run.weight);
    }
  }

  [[nodiscard]] double prior(const SearchedDriveParameter& parameter, double value) const {
    const double away = distance(parameter, parameter.typical, value);
    return cost_.prior_weight * away * away;
  }

  void differentiate(const DriveValues& values, double by, std::size_t from, std::size_t part,
                     std::size_t count) {
    DriveLanes lanes = DriveLanes::all(values);
    std::array<double, kDriveLanes> inverse_step{};
    for (std::size_t k = 0; k < part; ++k) {
      const SearchedDriveParameter& parameter = problem_.searched[from + k];
      const double value = values[parameter.index];
      double next = moved(parameter, value, by);
      if (distance(parameter, value, next) < 0.5 * by) next = moved(parameter, value, -by);
      lanes.of[parameter.index][k + 1] = next;
      inverse_step[k + 1] = 1.0 / distance(parameter, value, next);
    }
    const bool is_whole = count <= kDriveLanes - 1;
    std::array<double, kDriveLanes> row{};
    std::array<std::array<double, kDriveLanes>, kDriveLanes> sums{};
    std::array<double, kDriveLanes> right{};
    each_sample(lanes, [&](const double* angle, double measured, double weight) {
      const double error = angle[0] - measured;
      const double ratio = error / cost_.huber_rad;
      const double robust = weight / std::sqrt(1.0 + ratio * ratio);
      for (std::size_t k = 1; k <= part; ++k) row[k] = (angle[k] - angle[0]) * inverse_step[k];
      for (std::size_t k = 1; k <= part; ++k) right[k] += robust * error * row[k];
      if (is_whole) {
        for (std::size_t i = 1; i <= part; ++i)
          for (std::size_t j = 1; j <= i; ++j) sums[i][j] += robust * row[i] * row[j];
      } else {
        for (std::size_t k = 1; k <= part; ++k)
          jacobians_[from + k - 1].push_back(std::sqrt(robust) * row[k]);
      }
    });
    for (std::size_t i = 0; i < part; ++i) {
      const auto at = static_cast<Eigen::Index>(from + i);
      gradient[at] = right[i + 1];
      if (is_whole)
        for (std::size_t j = 0; j <= i; ++j)
          matrix(at, static_cast<Eigen::Index>(j)) = matrix(static_cast<Eigen::Index>(j), at) =
              sums[i + 1][j + 1];
    }
  }

  void multiply_columns(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = 0.0;
        for (std::size_t n = 0; n < jacobians_[i].size(); ++n)
          sum += jacobians_[i][n] * jacobians_[j][n];
        matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = sum;
        matrix(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = sum;
      }
  }

  const DriveProblem& problem_;
  DriveCost cost_;
  std::vector<WeightedRun> runs_;
  detail::AlignedVector<double> angles_;
  std::vector<std::vector<double>> jacobians_;
};

/// The steps of sixteen dampings from `values`, each within the bounds.
std::array<DriveValues, kDriveLanes> damped_steps(const DriveProblem& problem,
                                                  const DriveValues& values,
                                                  const Eigen::MatrixXd& matrix,
                                                  const Eigen::VectorXd& gradient) {
  std::array<DriveValues, kDriveLanes> steps;
  steps.fill(values);
  constexpr double kLongest = 1.0;  // a factor of e
  const double floor = 1e-9 * std::max(matrix.diagonal().maxCoeff(), 1e-300);
  for (std::size_t k = 0; k < kDriveLanes; ++k) {
    const double damping = std::pow(10.0, -5.0 + 0.55 * static_cast<double>(k));
    Eigen::MatrixXd damped = matrix;
    damped.diagonal() +=
        damping * matrix.diagonal() + Eigen::VectorXd::Constant(matrix.rows(), floor);
    const Eigen::VectorXd step = damped.ldlt().solve(-gradient);
    if (!step.allFinite()) continue;
    const double length = step.cwiseAbs().maxCoeff();
    const double share = length > kLongest ? kLongest / length : 1.0;
    for (std::size_t p = 0; p < problem.searched.size(); ++p) {
      const SearchedDriveParameter& parameter = problem.searched[p];
      steps[k][parameter.index] =
          moved(parameter, values[parameter.index], share * step[static_cast<Eigen::Index>(p)]);
    }
  }
  return steps;
}

/// Least squares around a sample.
struct Parabola {
  std::size_t samples = 0;
  double angle_rad = 0.0;
  double speed_rad_s = 0.0;
  double variance = 0.0;  ///< mean squared residual [rad^2]
};

Parabola parabola_around(const DriveLog& log, std::size_t centre, std::size_t reach) {
  const std::size_t begin = centre > reach ? centre - reach : 0;
  const std::size_t end = std::min(centre + reach + 1, log.size());
  Parabola found{.samples = end - begin};
  if (found.samples < 4) return found;
  const auto row = [&](std::size_t n) {
    const double t =
        (static_cast<double>(n) - static_cast<double>(centre)) / static_cast<double>(reach);
    return Eigen::Vector3d(1.0, t, t * t);
  };
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t n = begin; n < end; ++n) {
    matrix += row(n) * row(n).transpose();
    right += row(n) * log.angle_rad[n];
  }
  const Eigen::Vector3d fit = matrix.ldlt().solve(right);
  found.angle_rad = fit[0];
  found.speed_rad_s = fit[1] / (static_cast<double>(reach) * log.sample_period_s);
  for (std::size_t n = begin; n < end; ++n)
    found.variance +=
        std::pow(row(n).dot(fit) - log.angle_rad[n], 2) / static_cast<double>(found.samples - 3);
  return found;
}

}  // namespace

DriveRun run_from(const DriveLog& log, std::size_t first, std::size_t samples) {
  constexpr double kWidest_s = 0.03;
  constexpr std::size_t kFewestSamples = 8;  // in a narrower window
  std::size_t reach = std::max<std::size_t>(
      static_cast<std::size_t>(std::lround(kWidest_s / log.sample_period_s)), 2);
  Parabola parabola = parabola_around(log, first, reach);
  if (parabola.samples < 4) return {first, samples, log.angle_rad[first], 0.0};
  // A parabola over 30 ms does not fit a motion that begins with a jerk.
  while (true) {
    reach /= 2;
    const Parabola narrower = parabola_around(log, first, reach);
    if (narrower.samples < kFewestSamples || narrower.variance > 0.5 * parabola.variance) break;
    parabola = narrower;
  }
  return {first, samples, parabola.angle_rad, parabola.speed_rad_s};
}

std::vector<double> costs_of(const DriveProblem& problem, std::span<const DriveValues> candidates,
                             const DriveCost& cost) {
  Evaluation evaluation(problem, cost);
  std::vector<double> costs;
  costs.reserve(candidates.size());
  for (std::size_t from = 0; from < candidates.size(); from += kDriveLanes) {
    DriveLanes lanes{};
    for (std::size_t lane = 0; lane < kDriveLanes; ++lane)
      lanes.set(lane, candidates[std::min(from + lane, candidates.size() - 1)]);
    const auto part = evaluation.costs(lanes);
    for (std::size_t lane = 0; lane < kDriveLanes && from + lane < candidates.size(); ++lane)
      costs.push_back(part[lane]);
  }
  return costs;
}

DriveSolution search_drive(const DriveProblem& problem, const DriveValues& start,
                           const DriveCost& cost, std::span<const double> differences,
                           std::size_t max_iterations, const Progress& progress) {
  Evaluation evaluation(problem, cost);
  DriveSolution best{.values = start};
  DriveLanes lanes = DriveLanes::all(start);
  best.cost = evaluation.costs(lanes)[0];
  constexpr double kWorthwhile = 1e-3;
  for (const double by : differences) {
    for (std::size_t k = 0; k < max_iterations; ++k) {
      report_progress(progress, 0.0, "free runs");
      evaluation.linearise(best.values, by);
      if (!evaluation.matrix.allFinite() || !evaluation.gradient.allFinite()) break;
      const auto steps = damped_steps(problem, best.values, evaluation.matrix, evaluation.gradient);
      for (std::size_t lane = 0; lane < kDriveLanes; ++lane) lanes.set(lane, steps[lane]);
      const auto costs = evaluation.costs(lanes);
      const auto* const least = std::min_element(costs.begin(), costs.end());
      ++best.iterations;
      if (!(*least < best.cost)) break;
      const double gain = 1.0 - *least / best.cost;
      best.cost = *least;
      best.values = steps[static_cast<std::size_t>(least - costs.begin())];
      if (gain < kWorthwhile) break;
    }
  }
  return best;
}

DriveScore score_drive(const DriveProblem& problem, const DriveValues& values) {
  DriveScore score;
  DriveLanes lanes = DriveLanes::all(values);
  detail::AlignedVector<double> angles;
  double squares = 0.0;
  for (const DriveLog* log : problem.logs) {
    angles.resize(log->size() * kDriveLanes);
    problem.roll_out(*log, run_from(*log, 0, log->size()), lanes, angles.data());
    double sum = 0.0;
    double square = 0.0;
    for (std::size_t n = 0; n < log->size(); ++n) {
      const double error = angles[n * kDriveLanes] - log->angle_rad[n];
      sum += std::abs(error);
      square += error * error;
    }
    score.mae_of_log_rad.push_back(sum / static_cast<double>(log->size()));
    score.rmse_of_log_rad.push_back(std::sqrt(square / static_cast<double>(log->size())));
    squares += square / static_cast<double>(log->size());
    score.mae_rad += score.mae_of_log_rad.back() / static_cast<double>(problem.logs.size());
  }
  score.rmse_rad = std::sqrt(squares / static_cast<double>(problem.logs.size()));
  return score;
}

std::vector<double> drive_information(const DriveProblem& problem, const DriveValues& values) {
  constexpr double kQuadratic_rad = 1e6;  // the loss is that of least squares
  Evaluation evaluation(problem, {.window_s = 0.0, .huber_rad = kQuadratic_rad});
  evaluation.linearise(values, 0.01);
  std::vector<double> rows;
  const auto count = static_cast<Eigen::Index>(problem.searched.size());
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j)
      rows.push_back(evaluation.matrix(i, j) * static_cast<double>(problem.logs.size()));
  return rows;
}

}  // namespace torsio
