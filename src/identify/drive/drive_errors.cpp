#include "identify/drive/drive_errors.hpp"

#include <algorithm>
#include <cmath>

#include "numerics/parallel.hpp"
#include "numerics/student_t.hpp"

namespace torsio {
namespace {

constexpr std::size_t kFewestLogs = 3;
constexpr double kIntervalProbability = 0.95;
// A parameter whose interval spans more than this factor, or this share of its range, is not determined.
constexpr double kWidestFactor = 10.0;
constexpr double kWidestShare = 0.5;

double in_search(const SearchedDriveParameter& parameter, double value) {
  return parameter.is_positive ? std::log(value) : value;
}

/// Squared standard errors in the scale of the search, one for each searched parameter.
std::vector<double> jackknife(const DriveProblem& problem, const std::vector<DriveLog>& logs,
                              const DriveTerms& terms, const DriveValues& values,
                              const DriveFitOptions& options, std::size_t threads) {
  std::vector<DriveValues> without(logs.size());
  for_each_chunk(logs.size(), threads, [&](std::size_t left_out) {
    DriveLogs rest;
    for (std::size_t k = 0; k < logs.size(); ++k)
      if (k != left_out) rest.push_back(&logs[k]);
    without[left_out] = refit_drive(rest, terms, values, options).values;
  });
  const auto count = static_cast<double>(logs.size());
  std::vector<double> variances;
  for (const SearchedDriveParameter& parameter : problem.searched) {
    double mean = 0.0;
    for (const DriveValues& fit : without)
      mean += in_search(parameter, fit[parameter.index]) / count;
    double square = 0.0;
    for (const DriveValues& fit : without) {
      const double away = in_search(parameter, fit[parameter.index]) - mean;
      square += away * away;
    }
    variances.push_back((count - 1.0) / count * square);
  }
  return variances;
}

/// The same from the errors of the load, each a fit with the load one standard error off.
std::vector<double> from_load(const DriveProblem& problem, const std::vector<DriveLog>& logs,
                              const DriveTerms& terms, const DriveValues& values,
                              const DriveFitOptions& options, std::size_t threads) {
  const std::size_t errors = logs.front().load.errors.size();
  std::vector<DriveValues> moved(errors);
  for_each_chunk(errors, threads, [&](std::size_t e) {
    std::vector<DriveLog> changed = logs;
    DriveLogs all;
    for (DriveLog& log : changed) {
      if (e < log.load.errors.size()) {
        const JointLoad& change = log.load.errors[e].change;
        log.load.load.gravity_Nm += change.gravity_Nm;
        log.load.load.inertia_kg_m2 += change.inertia_kg_m2;
        log.load.load.zero_rad += change.zero_rad;
      }
      all.push_back(&log);
    }
    moved[e] = refit_drive(all, terms, values, options).values;
  });
  std::vector<double> variances;
  for (const SearchedDriveParameter& parameter : problem.searched) {
    double square = 0.0;
    for (const DriveValues& fit : moved) {
      const double away = in_search(parameter, fit[parameter.index]) -
                          in_search(parameter, values[parameter.index]);
      square += away * away;
    }
    variances.push_back(square);
  }
  return variances;
}

void set_errors(const SearchedDriveParameter& searched, double variance, double load_variance,
                std::size_t logs, IdentifiedDriveParameter& parameter) {
  const double error = std::sqrt(variance + load_variance);
  const double reach = student_t(kIntervalProbability, logs - 1) * error;
  if (searched.is_positive) {
    parameter.standard_error = parameter.value * error;
    parameter.from_load = parameter.value * std::sqrt(load_variance);
    parameter.lowest = parameter.value * std::exp(-reach);
    parameter.highest = parameter.value * std::exp(reach);
    parameter.is_determined = 2.0 * reach < std::log(kWidestFactor);
  } else {
    parameter.standard_error = error;
    parameter.from_load = std::sqrt(load_variance);
    parameter.lowest = parameter.value - reach;
    parameter.highest = parameter.value + reach;
    parameter.is_determined = 2.0 * reach < kWidestShare * (searched.highest - searched.lowest);
  }
}

}  // namespace

std::vector<IdentifiedDriveParameter> parameters_with_errors(
    const std::vector<DriveLog>& logs, const DriveTerms& terms, const DriveValues& values,
    bool wants_errors, const DriveFitOptions& options, std::size_t threads) {
  const DriveLogs all = pointers_to(logs);
  const DriveProblem problem = drive_problem(all, terms, options);
  std::vector<double> variances;
  std::vector<double> load_variances;
  const bool has_errors = wants_errors && logs.size() >= kFewestLogs;
  if (has_errors) {
    variances = jackknife(problem, logs, terms, values, options, threads);
    load_variances = from_load(problem, logs, terms, values, options, threads);
  }
  std::vector<IdentifiedDriveParameter> parameters;
  parameters.reserve(problem.searched.size());
  constexpr double kAtBound = 1.001;
  for (std::size_t k = 0; k < problem.searched.size(); ++k) {
    const SearchedDriveParameter& searched = problem.searched[k];
    IdentifiedDriveParameter parameter{.parameter = static_cast<DriveParameter>(searched.index),
                                       .value = values[searched.index]};
    parameter.is_at_bound = searched.is_positive ? parameter.value < searched.lowest * kAtBound ||
                                                       parameter.value * kAtBound > searched.highest
                                                 : parameter.value <= searched.lowest ||
                                                       parameter.value >= searched.highest;
    if (has_errors) set_errors(searched, variances[k], load_variances[k], logs.size(), parameter);
    parameters.push_back(parameter);
  }
  return parameters;
}

}  // namespace torsio
