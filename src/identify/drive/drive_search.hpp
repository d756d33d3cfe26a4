#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "identify/drive/drive_log.hpp"
#include "identify/drive/drive_rollout.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/identify/drive/drive_model.hpp"

namespace torsio {

/// Sixteen sets of parameters through one run: torsio's equations, or those of another program. `angle_rad` is
/// [sample][lane].
using RollOutLanes = std::function<void(const DriveLog& log, const DriveRun& run,
                                        const DriveLanes& parameters, double* angle_rad)>;

/// A number that is searched for, in the scale of the search.
struct SearchedDriveParameter {
  std::size_t index = 0;  ///< row of `DriveLanes`
  double lowest = 0.0;
  double highest = 0.0;
  bool is_positive = true;  ///< the search goes by its logarithm
  double typical = 1.0;     ///< middle of the weak prior, > 0 where the parameter is
};

struct DriveProblem {
  std::vector<const DriveLog*> logs;
  std::vector<SearchedDriveParameter> searched;
  std::vector<double> log_weights;  ///< in the loss, a mean of 1; empty: all 1
  RollOutLanes roll_out;
};

/// What is minimised: the mean over the logs of the mean pseudo-Huber loss of the error of the angle, of free runs of
/// `window_s` each (0: of the whole log).
struct DriveCost {
  double window_s = 0.0;
  double huber_rad = 0.02;
  double prior_weight = 0.0;  ///< factor of the squared distance from the typical values
};

struct DriveSolution {
  DriveValues values{};
  double cost = 0.0;
  std::size_t iterations = 0;
};

/// Mean over the logs of the mean |error of the angle| in free runs of the whole logs.
struct DriveScore {
  double mae_rad = 0.0;
  double rmse_rad = 0.0;
  std::vector<double> mae_of_log_rad;
  std::vector<double> rmse_of_log_rad;
};

/// Levenberg-Marquardt from `start`, by forward differences of 3, 1 and 0.3 %: what stops and starts make rough looks
/// smooth from afar. Sixteen dampings are tried at once.
[[nodiscard]] DriveSolution search_drive(const DriveProblem& problem, const DriveValues& start,
                                         const DriveCost& cost, std::span<const double> differences,
                                         std::size_t max_iterations, const Progress& progress = {});

[[nodiscard]] DriveScore score_drive(const DriveProblem& problem, const DriveValues& values);

/// The costs of many sets of parameters, infinite where a run left all bounds.
[[nodiscard]] std::vector<double> costs_of(const DriveProblem& problem,
                                           std::span<const DriveValues> candidates,
                                           const DriveCost& cost);

/// Second derivatives of half the sum over the logs of the mean squared error of the angle, at `values`, in the scale of
/// the search: row by row.
[[nodiscard]] std::vector<double> drive_information(const DriveProblem& problem,
                                                    const DriveValues& values);

/// Where a free run starts: a parabola through the angles within 30 ms.
[[nodiscard]] DriveRun run_from(const DriveLog& log, std::size_t first, std::size_t samples);

}  // namespace torsio
