#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "identify/drive/drive_log.hpp"
#include "identify/drive/drive_search.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/identify/drive/drive_model.hpp"

namespace torsio {

using DriveLogs = std::vector<const DriveLog*>;
[[nodiscard]] DriveLogs pointers_to(const std::vector<DriveLog>& logs);

struct DriveFitOptions {
  std::size_t starts = 3;
  std::uint64_t seed = 1;
  double step_s = 0.0;  ///< 0: `drive_step_s`
  DriveIntegrator integrator = DriveIntegrator::midpoint_speed;
  Progress progress = {};
};

/// Longest step of the integrator: 2.5 ms with one mass, 1 ms with two.
[[nodiscard]] double drive_step_s(const DriveTerms& terms, const DriveFitOptions& options);

/// The terms that a law can have at all: without a winding it has neither resistance nor duty.
[[nodiscard]] DriveTerms possible_terms(CommandKind kind, bool has_spring, bool fits_joint_inertia);

/// What the free runs of these logs need to be searched for: parameters with their ranges, and typical values from how
/// the logs moved.
[[nodiscard]] DriveProblem drive_problem(const DriveLogs& logs, const DriveTerms& terms,
                                         const DriveFitOptions& options);

/// A weak prior around typical values keeps a parameter that the logs do not determine from running to its bound: a
/// factor of e costs 3 % of the loss, 0.3 % with a spring.
/// From typical values and random ones around them, over windows that grow to the whole logs.
[[nodiscard]] DriveSolution fit_drive(const DriveLogs& logs, const DriveTerms& terms,
                                      const DriveFitOptions& options);

/// `fit_drive` of any equations, from the typical values of the problem.
[[nodiscard]] DriveSolution fit_problem(const DriveProblem& problem, const DriveValues& typical,
                                        const DriveFitOptions& options);

/// From values that are near, over the whole logs. Terms that `terms` lacks are made neutral; new ones begin typical.
[[nodiscard]] DriveSolution refit_drive(const DriveLogs& logs, const DriveTerms& terms,
                                        const DriveValues& start, const DriveFitOptions& options);

}  // namespace torsio
