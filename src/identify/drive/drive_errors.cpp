#include "identify/drive/drive_errors.hpp"

#include <algorithm>
#include <cmath>

#include "numerics/jackknife.hpp"
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
  std::vector<double> variances;
  for (const SearchedDriveParameter& parameter : problem.searched) {
    std::vector<double> values_without;
    values_without.reserve(without.size());
    for (const DriveValues& fit : without)
      values_without.push_back(in_search(parameter, fit[parameter.index]));
    variances.push_back(jackknife_variance(values_without));
  }
  return variances;
}

// A search ends before it follows a change of a few parts in a thousand: the fit is that of an error of this share, whose
// effect is divided by the enlargement.
constexpr double kEnlargedTo = 0.05;
constexpr double kMaxEnlargement = 100.0;

double enlargement(double share) {
  return share > 0.0 ? std::clamp(kEnlargedTo / share, 1.0, kMaxEnlargement) : 1.0;
}

/// The largest of the changes by an error of the load, of gravity and inertia as shares, of the zero in rad.
double share_of_load(const std::vector<DriveLog>& logs, std::size_t error) {
  double share = 0.0;
  for (const DriveLog& log : logs) {
    if (error >= log.load.errors.size()) continue;
    const JointLoad& change = log.load.errors[error].change;
    if (log.load.load.gravity_Nm > 0.0)
      share = std::max(share, std::abs(change.gravity_Nm) / log.load.load.gravity_Nm);
    if (log.load.load.inertia_kg_m2 > 0.0)
      share = std::max(share, std::abs(change.inertia_kg_m2) / log.load.load.inertia_kg_m2);
    share = std::max(share, std::abs(change.zero_rad));
  }
  return share;
}

/// Squared changes of the searched parameters, in the scale of the search, by one standard error of something that the
/// logs state.
/// @param factor by which `changed` has that error enlarged
std::vector<double> squared_changes(const DriveProblem& problem,
                                    const std::vector<DriveLog>& changed, double factor,
                                    const DriveTerms& terms, const DriveValues& values,
                                    const DriveFitOptions& options) {
  const DriveValues fit = refit_drive(pointers_to(changed), terms, values, options).values;
  std::vector<double> squares;
  for (const SearchedDriveParameter& parameter : problem.searched) {
    const double away =
        in_search(parameter, fit[parameter.index]) - in_search(parameter, values[parameter.index]);
    squares.push_back(away * away / (factor * factor));
  }
  return squares;
}

/// The same as `jackknife` from the errors of the load, each a fit with the load one standard error off.
std::vector<double> from_load(const DriveProblem& problem, const std::vector<DriveLog>& logs,
                              const DriveTerms& terms, const DriveValues& values,
                              const DriveFitOptions& options, std::size_t threads) {
  const std::size_t errors = logs.front().load.errors.size();
  std::vector<std::vector<double>> squares(errors);
  for_each_chunk(errors, threads, [&](std::size_t e) {
    const double factor = enlargement(share_of_load(logs, e));
    std::vector<DriveLog> changed = logs;
    for (DriveLog& log : changed) {
      if (e >= log.load.errors.size()) continue;
      const JointLoad& change = log.load.errors[e].change;
      log.load.load.gravity_Nm += factor * change.gravity_Nm;
      log.load.load.inertia_kg_m2 += factor * change.inertia_kg_m2;
      log.load.load.zero_rad += factor * change.zero_rad;
    }
    squares[e] = squared_changes(problem, changed, factor, terms, values, options);
  });
  std::vector<double> variances(problem.searched.size(), 0.0);
  for (const std::vector<double>& square : squares)
    for (std::size_t k = 0; k < variances.size(); ++k) variances[k] += square[k];
  return variances;
}

/// The same from the error of the laws' gain.
std::vector<double> from_gain(const DriveProblem& problem, const std::vector<DriveLog>& logs,
                              double relative_error, const DriveTerms& terms,
                              const DriveValues& values, const DriveFitOptions& options) {
  const double factor = enlargement(relative_error);
  std::vector<DriveLog> changed = logs;
  for (DriveLog& log : changed) log.gain *= 1.0 + factor * relative_error;
  return squared_changes(problem, changed, factor, terms, values, options);
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
    bool wants_errors, double relative_gain_error, const DriveFitOptions& options,
    std::size_t threads) {
  const DriveLogs all = pointers_to(logs);
  const DriveProblem problem = drive_problem(all, terms, options);
  std::vector<double> variances;
  std::vector<double> load_variances;
  const bool has_errors = wants_errors && logs.size() >= kFewestLogs;
  if (has_errors) {
    variances = jackknife(problem, logs, terms, values, options, threads);
    load_variances = from_load(problem, logs, terms, values, options, threads);
  }
  if (has_errors && relative_gain_error > 0.0) {
    const std::vector<double> more =
        from_gain(problem, logs, relative_gain_error, terms, values, options);
    for (std::size_t k = 0; k < more.size(); ++k) variances[k] += more[k];
  }
  std::vector<IdentifiedDriveParameter> parameters;
  parameters.reserve(problem.searched.size());
  constexpr double kAtBound = 1.001;
  for (std::size_t k = 0; k < problem.searched.size(); ++k) {
    const SearchedDriveParameter& searched = problem.searched[k];
    IdentifiedDriveParameter parameter{.parameter = static_cast<DriveParameter>(searched.index),
                                       .value = values[searched.index]};
    // The delay of a law is 0 at least: that does not limit the search.
    parameter.is_at_bound = searched.is_positive
                                ? parameter.value < searched.lowest * kAtBound ||
                                      parameter.value * kAtBound > searched.highest
                                : (parameter.value <= searched.lowest && searched.lowest < 0.0) ||
                                      parameter.value >= searched.highest;
    if (has_errors) set_errors(searched, variances[k], load_variances[k], logs.size(), parameter);
    parameters.push_back(parameter);
  }
  return parameters;
}

}  // namespace torsio
