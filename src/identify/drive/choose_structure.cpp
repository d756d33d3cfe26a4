#include "identify/drive/choose_structure.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "numerics/parallel.hpp"

namespace torsio {
namespace {

// A term goes if the held-out error falls by this share without it, and by one standard error of the recordings'
// differences. A term that hardly changes the fit goes even if the held-out error only does not rise.
constexpr double kIdle = 1.01;  // share of the loss of training without the term
constexpr double kLeastFall = 0.03;
constexpr std::size_t kCandidates = 3;  // terms whose held-out errors are computed

/// A spring takes with it what needs it.
DriveTerms without_term(const DriveTerms& terms, DriveTerm term) {
  DriveTerms rest = terms;
  rest.reset(static_cast<std::size_t>(term));
  if (term == DriveTerm::spring)
    rest &= ~drive_terms({DriveTerm::hysteresis, DriveTerm::backlash, DriveTerm::bearing,
                          DriveTerm::presliding, DriveTerm::joint_inertia});
  return rest;
}

std::vector<DriveTerm> removable(const DriveTerms& terms) {
  std::vector<DriveTerm> all;
  for (std::size_t k = 1; k < kDriveTerms; ++k)
    if (terms.test(k)) all.push_back(static_cast<DriveTerm>(k));
  return all;
}

void score(const GroupedLogs& logs, HeldOutStructure& structure, const DriveFitOptions& options) {
  structure.mae_of_log_rad.assign(logs.logs.size(), 0.0);
  for (std::size_t k = 0; k < logs.logs.size(); ++k) {
    const DriveProblem one = drive_problem({logs.logs[k]}, structure.terms, options);
    const double mae_rad = score_drive(one, structure.fits[logs.group[k]].values).mae_rad;
    structure.mae_of_log_rad[k] = std::isfinite(mae_rad) ? mae_rad : HUGE_VAL;
  }
  structure.mae_rad =
      std::reduce(structure.mae_of_log_rad.begin(), structure.mae_of_log_rad.end()) /
      static_cast<double>(logs.logs.size());
}

double standard_error(const std::vector<double>& a, const std::vector<double>& b) {
  const auto count = static_cast<double>(a.size());
  if (a.size() < 2) return kNotMeasured;
  double mean = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) mean += (a[k] - b[k]) / count;
  double square = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) square += (a[k] - b[k] - mean) * (a[k] - b[k] - mean);
  return std::sqrt(square / (count - 1.0) / count);
}

/// The terms whose absence raises the loss of the training least.
std::vector<DriveTerm> cheapest(const GroupedLogs& logs, const HeldOutStructure& now,
                                const DriveFitOptions& options, std::size_t threads) {
  const std::vector<DriveTerm> terms = removable(now.terms);
  std::vector<double> losses(terms.size());
  // The folds overlap in most of their logs: the first one's fit is a start that is near enough for all logs.
  for_each_chunk(terms.size(), threads, [&](std::size_t k) {
    losses[k] =
        refit_drive(logs.logs, without_term(now.terms, terms[k]), now.fits.front().values, options)
            .cost;
  });
  std::vector<std::size_t> order(terms.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return losses[k]; });
  std::vector<DriveTerm> best;
  for (std::size_t k = 0; k < std::min(kCandidates, order.size()); ++k)
    best.push_back(terms[order[k]]);
  return best;
}

/// The structures without one of the candidates each, refitted without each group from the fits that they come from.
std::vector<HeldOutStructure> trials_without(const GroupedLogs& logs, const HeldOutStructure& now,
                                             const std::vector<DriveTerm>& candidates,
                                             const DriveFitOptions& options, std::size_t threads) {
  std::vector<HeldOutStructure> trials(candidates.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    trials[c].terms = without_term(now.terms, candidates[c]);
    trials[c].fits.resize(logs.groups);
  }
  for_each_chunk(candidates.size() * logs.groups, threads, [&](std::size_t k) {
    const std::size_t c = k / logs.groups;
    const std::size_t group = k % logs.groups;
    trials[c].fits[group] =
        refit_drive(logs.without(group), trials[c].terms, now.fits[group].values, options);
  });
  for (HeldOutStructure& trial : trials) score(logs, trial, options);
  return trials;
}

double loss_of_training(const HeldOutStructure& structure) {
  double sum = 0.0;
  for (const DriveSolution& fit : structure.fits) sum += fit.cost;
  return sum;
}

bool is_better_without(const HeldOutStructure& without, const HeldOutStructure& with, double least,
                       double scatter) {
  if (!std::isfinite(with.mae_rad)) return std::isfinite(without.mae_rad);
  const bool is_beyond_scatter = with.mae_rad - without.mae_rad >= scatter;
  if (is_beyond_scatter && without.mae_rad <= (1.0 - kLeastFall) * least) return true;
  const bool is_idle = loss_of_training(without) <= kIdle * loss_of_training(with);
  return is_idle && without.mae_rad <= with.mae_rad;
}

}  // namespace

DriveLogs GroupedLogs::without(std::size_t left_out) const {
  DriveLogs rest;
  for (std::size_t k = 0; k < logs.size(); ++k)
    if (group[k] != left_out) rest.push_back(logs[k]);
  return rest;
}

GroupedLogs GroupedLogs::subset_without(std::size_t left_out) const {
  return grouped(without(left_out));
}

GroupedLogs grouped(const DriveLogs& logs) {
  GroupedLogs result{.logs = logs, .group = {}, .groups = 0};
  std::vector<std::string> names;
  for (const DriveLog* log : logs) {
    auto known = std::ranges::find(names, log->group);
    if (known == names.end()) known = names.insert(names.end(), log->group);
    result.group.push_back(static_cast<std::size_t>(known - names.begin()));
  }
  result.groups = names.size();
  return result;
}

HeldOutStructure hold_out(const GroupedLogs& logs, const DriveTerms& terms,
                          const DriveFitOptions& options, std::size_t threads) {
  HeldOutStructure structure{
      .terms = terms, .fits = std::vector<DriveSolution>(logs.groups), .mae_of_log_rad = {}};
  for_each_chunk(logs.groups, threads, [&](std::size_t group) {
    structure.fits[group] = fit_drive(logs.without(group), terms, options);
  });
  score(logs, structure, options);
  return structure;
}

ChosenStructure choose_structure(const GroupedLogs& logs, const DriveTerms& largest,
                                 const DriveFitOptions& options, std::size_t threads) {
  ChosenStructure chosen{.held_out = hold_out(logs, largest, options, threads), .trials = {}};
  chosen.trials.push_back({.terms = largest,
                           .change = "all terms",
                           .mae_rad = chosen.held_out.mae_rad,
                           .is_taken = true});
  double least = chosen.held_out.mae_rad;
  while (!removable(chosen.held_out.terms).empty()) {
    const HeldOutStructure& now = chosen.held_out;
    const std::vector<DriveTerm> candidates = cheapest(logs, now, options, threads);
    std::vector<HeldOutStructure> trials = trials_without(logs, now, candidates, options, threads);
    const std::size_t first = chosen.trials.size();
    for (std::size_t c = 0; c < candidates.size(); ++c)
      chosen.trials.push_back(
          {.terms = trials[c].terms,
           .change = "without " + std::string(name(candidates[c])),
           .mae_rad = trials[c].mae_rad,
           .gain_error_rad = standard_error(trials[c].mae_of_log_rad, now.mae_of_log_rad)});
    const auto best = static_cast<std::size_t>(
        std::ranges::min_element(trials, {}, &HeldOutStructure::mae_rad) - trials.begin());
    const double scatter = chosen.trials[first + best].gain_error_rad;
    if (!is_better_without(trials[best], now, least, scatter)) break;
    chosen.trials[first + best].is_taken = true;
    chosen.held_out = std::move(trials[best]);
    least = std::min(least, chosen.held_out.mae_rad);
  }
  return chosen;
}

}  // namespace torsio
