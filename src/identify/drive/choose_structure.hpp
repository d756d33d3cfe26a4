#pragma once

#include <string>
#include <vector>

#include "identify/drive/drive_fit.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// A structure, its fits without one group each, and their errors on that group.
struct HeldOutStructure {
  DriveTerms terms;
  std::vector<DriveSolution> fits;     ///< one for each group
  std::vector<double> mae_of_log_rad;  ///< by the fit without the log's group
  double mae_rad = 0.0;
};

/// Logs and which are left out together.
struct GroupedLogs {
  DriveLogs logs;
  std::vector<std::size_t> group;  ///< group of each log, 0 .. groups - 1
  std::size_t groups = 0;

  [[nodiscard]] DriveLogs without(std::size_t left_out) const;
  [[nodiscard]] GroupedLogs subset_without(std::size_t left_out) const;
};
[[nodiscard]] GroupedLogs grouped(const DriveLogs& logs);

[[nodiscard]] HeldOutStructure hold_out(const GroupedLogs& logs, const DriveTerms& terms,
                                        const DriveFitOptions& options, std::size_t threads);

struct ChosenStructure {
  HeldOutStructure held_out;
  std::vector<StructureTrial> trials;
};

/// From all terms of `largest` one after the other is taken out, that whose absence costs least, as long as the held-out
/// error falls by 3 % and by one standard error of the recordings' differences: a weak prior holds
/// the other terms. A term whose absence raises neither the held-out error nor, by 1 %, the loss of training goes, too.
[[nodiscard]] ChosenStructure choose_structure(const GroupedLogs& logs, const DriveTerms& largest,
                                               const DriveFitOptions& options, std::size_t threads);

}  // namespace torsio
