#include "identify/drive/drive_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <random>
#include <span>

namespace torsio {
namespace {

constexpr std::array<double, 3> kDifferences{0.03, 0.01, 0.003};

/// Weight of the prior as a share of the loss. What a second mass does to the motor's encoder is small: there it is
/// smaller.
double prior_share(const DriveProblem& problem) {
  constexpr double kRigid = 0.03;
  constexpr double kElastic = 0.003;
  const bool is_elastic = std::ranges::any_of(problem.searched, [](const auto& parameter) {
    return parameter.index == static_cast<std::size_t>(DriveParameter::stiffness);
  });
  return is_elastic ? kElastic : kRigid;
}

bool is_searched(const DriveParameterInfo& info, const DriveTerms& terms, CommandKind kind) {
  if (!has(terms, info.term)) return false;
  if (info.parameter == DriveParameter::torque_constant)
    return has_winding(kind) || kind == CommandKind::current;
  if (info.parameter == DriveParameter::resistance) return has_winding(kind);
  return true;
}

/// How far and how fast logs moved, and what the load asked for.
struct Scales {
  double torque_Nm = 1.0;
  double speed_rad_s = 1.0;
  double command = 1.0;
  double inertia_kg_m2 = 1.0;
  double supply_V = 1.0;
};

Scales scales_of(const DriveLogs& logs) {
  Scales scales{
      .torque_Nm = 0.0, .speed_rad_s = 0.0, .command = 0.0, .inertia_kg_m2 = 0.0, .supply_V = 0.0};
  for (const DriveLog* log : logs) {
    const double period = log->sample_period_s;
    // Over 25 ms, which is long against the noise of an encoder and short against a motion.
    const auto reach =
        std::max<std::size_t>(static_cast<std::size_t>(std::lround(0.025 / period)), 1);
    std::vector<double> speeds;
    for (std::size_t n = reach; n + reach < log->size(); ++n)
      speeds.push_back(std::abs(log->angle_rad[n + reach] - log->angle_rad[n - reach]) /
                       (2.0 * static_cast<double>(reach) * period));
    if (speeds.empty()) speeds.push_back(0.0);
    const auto high =
        speeds.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(speeds.size() - 1));
    std::ranges::nth_element(speeds, high);
    scales.speed_rad_s = std::max(scales.speed_rad_s, *high);
    scales.inertia_kg_m2 = std::max(scales.inertia_kg_m2, log->load.load.inertia_kg_m2);
    constexpr double kSwing_rad_s2 = 10.0;  // acceleration of a load without gravity
    scales.torque_Nm = std::max({scales.torque_Nm, log->load.load.gravity_Nm,
                                 kSwing_rad_s2 * log->load.load.inertia_kg_m2});
    double square = 0.0;
    for (const double value : log->command) square += value * value;
    scales.command = std::max(scales.command, std::sqrt(square / static_cast<double>(log->size())));
    scales.supply_V = std::max(scales.supply_V, log->supply_V);
  }
  constexpr double kLeast = 1e-6;
  scales.speed_rad_s = std::max(scales.speed_rad_s, 0.01);
  scales.torque_Nm = std::max(scales.torque_Nm, kLeast);
  scales.inertia_kg_m2 = std::max(scales.inertia_kg_m2, kLeast);
  scales.command = std::max(scales.command, kLeast);
  return scales;
}

DriveValues typical_values(const DriveLogs& logs, const DriveTerms& terms) {
  using enum DriveParameter;
  const Scales scales = scales_of(logs);
  const double torque = scales.torque_Nm;
  const double speed = scales.speed_rad_s;
  DriveValues all = neutral_drive_values();
  if (logs.front()->kind == CommandKind::current) {
    at(all, torque_constant) = torque / scales.command;
  } else {
    at(all, torque_constant) = 0.5 * scales.supply_V / speed;  // twice as fast without load
    at(all, resistance) = at(all, torque_constant) * scales.supply_V / (1.5 * torque);
  }
  at(all, armature) = 0.3 * scales.inertia_kg_m2;
  at(all, coulomb) = 0.04 * torque;
  at(all, viscous) = 0.02 * torque / speed;
  at(all, load_friction) = 0.05;
  at(all, load_stribeck) = 0.05;
  at(all, load_speed) = 0.1 * speed;
  at(all, stribeck) = 0.02 * torque;
  at(all, stribeck_speed) = 0.1 * speed;
  at(all, resistance_rise) = 0.1 * at(all, resistance);
  at(all, no_load_speed) = 1.2 * speed;
  at(all, stall_torque) = 10.0 * torque;
  at(all, joint_inertia) = 0.1 * scales.inertia_kg_m2;
  constexpr double kStiff_rad_s = 30.0;  // natural frequency of the load on the spring
  at(all, stiffness) = scales.inertia_kg_m2 * kStiff_rad_s * kStiff_rad_s;
  at(all, spring_damping) = 0.02 * scales.inertia_kg_m2 * kStiff_rad_s;
  at(all, hysteresis) = 0.02 * torque;
  at(all, hysteresis_width) = 0.3 * torque / at(all, stiffness);
  at(all, backlash) = 0.02 * torque / at(all, stiffness);
  at(all, bearing) = 0.02 * torque;
  at(all, bearing_viscous) = 0.02 * torque / speed;
  at(all, presliding) = 1e-3;
  DriveValues values = neutral_drive_values();
  for (const DriveParameterInfo& info : drive_parameters())
    if (is_searched(info, terms, logs.front()->kind))
      at(values, info.parameter) = std::clamp(at(all, info.parameter), info.lowest, info.highest);
  return values;
}

double loss_of(const DriveProblem& problem, const DriveValues& values, double window_s) {
  return costs_of(problem, std::span(&values, 1), {.window_s = window_s}).front();
}

/// Two searches: the weight of the prior follows from the loss, which the first one lowers.
DriveSolution descend(const DriveProblem& problem, const DriveValues& start, double window_s,
                      std::span<const double> differences, std::size_t iterations,
                      const Progress& progress) {
  DriveSolution best{.values = start, .cost = loss_of(problem, start, window_s)};
  for (int pass = 0; pass < 2; ++pass) {
    const DriveCost cost{.window_s = window_s, .prior_weight = prior_share(problem) * best.cost};
    if (!std::isfinite(best.cost)) break;
    const DriveSolution found =
        search_drive(problem, best.values, cost, differences, iterations, progress);
    best = {.values = found.values,
            .cost = loss_of(problem, found.values, window_s),
            .iterations = best.iterations + found.iterations};
    if (pass == 0) differences = differences.last(1);
  }
  return best;
}

DriveValues random_start(const DriveProblem& problem, DriveValues values, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  constexpr double kSpread = 0.5;
  for (const SearchedDriveParameter& parameter : problem.searched) {
    const double factor = std::exp(kSpread * normal(random));
    if (parameter.is_positive)
      values[parameter.index] =
          std::clamp(values[parameter.index] * factor, parameter.lowest, parameter.highest);
  }
  return values;
}

DriveSolution better(const DriveSolution& a, const DriveSolution& b) {
  return b.cost < a.cost ? b : a;
}

/// The motors that a search over springs begins with: typical ones and the best rigid one, lighter and heavier. Where the
/// joint's own inertia is searched for, a share of the inertia moves from the motor's side to the joint's.
std::vector<DriveValues> motor_starts(const DriveProblem& problem, const DriveValues& typical,
                                      const DriveValues& one_mass, double motor_share) {
  using enum DriveParameter;
  std::vector<DriveValues> motors;
  for (const DriveValues* motor : {&typical, &one_mass})
    for (const double inertia : {0.4, 1.0, 2.5}) {
      DriveValues values = typical;
      for (const SearchedDriveParameter& parameter : problem.searched)
        if (drive_parameters()[parameter.index].term <= DriveTerm::direction)
          values[parameter.index] = (*motor)[parameter.index];
      at(values, armature) *= inertia;
      if (motor_share < 1.0) at(values, joint_inertia) = (1.0 - motor_share) * at(values, armature);
      at(values, armature) *= motor_share;
      motors.push_back(values);
    }
  return motors;
}

/// A guess of the spring over three decades, each with the best of several motors: a search from one stiffness stays at
/// its resonance.
std::vector<DriveValues> spring_starts(const DriveProblem& problem, const DriveValues& typical,
                                       const DriveValues& one_mass, double motor_share) {
  using enum DriveParameter;
  constexpr int kStiffnesses = 16;
  std::vector<DriveValues> starts;
  for (int k = 0; k < kStiffnesses; ++k) {
    const double factor = std::pow(10.0, -1.5 + 3.0 * k / (kStiffnesses - 1));
    std::vector<DriveValues> motors = motor_starts(problem, typical, one_mass, motor_share);
    for (DriveValues& values : motors) {
      at(values, stiffness) *= factor;
      at(values, spring_damping) *= std::sqrt(factor);
      at(values, hysteresis_width) /= factor;
      at(values, backlash) /= factor;
      for (const SearchedDriveParameter& parameter : problem.searched)
        values[parameter.index] =
            std::clamp(values[parameter.index], parameter.lowest, parameter.highest);
    }
    const std::vector<double> costs = costs_of(problem, motors, {});
    starts.push_back(
        motors[static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin())]);
  }
  return starts;
}

DriveLogs always_powered(const DriveLogs& logs) {
  DriveLogs powered;
  std::ranges::copy_if(logs, std::back_inserter(powered),
                       [](const DriveLog* log) { return is_always_powered(*log); });
  return powered;
}

DriveSolution search_springs(const DriveLogs& logs, const DriveTerms& terms,
                             const DriveFitOptions& options) {
  const DriveProblem problem = drive_problem(logs, terms, options);
  const DriveValues typical = typical_values(logs, terms);
  const DriveTerms one = terms & possible_terms(logs.front()->kind, false, false);
  DriveFitOptions quick = options;
  quick.starts = 1;
  const DriveSolution stiff = fit_drive(logs, one, quick);
  constexpr std::size_t kFirstIterations = 5;
  std::vector<DriveSolution> near;
  std::vector<double> motor_shares{1.0};
  if (has(terms, DriveTerm::joint_inertia)) motor_shares = {0.9, 0.6, 0.3};
  for (const double share : motor_shares)
    for (const DriveValues& start : spring_starts(problem, typical, stiff.values, share))
      near.push_back(search_drive(problem, start, {}, std::span(kDifferences).first(1),
                                  kFirstIterations, options.progress));
  std::ranges::stable_sort(near, {}, &DriveSolution::cost);
  DriveSolution best{.values = typical, .cost = HUGE_VAL};
  for (std::size_t k = 0; k < std::min(std::max<std::size_t>(options.starts, 1), near.size()); ++k)
    best = better(best, descend(problem, near[k].values, 0.0, kDifferences, 40, options.progress));
  return best;
}

/// A recording that the model fits worse counts less, as if each had a noise of its own: weights of the inverse mean
/// square, down to a tenth of the mean.
std::vector<double> weights_by_error(const DriveProblem& problem, const DriveValues& values) {
  constexpr double kFloor = 0.1;
  const DriveScore score = score_drive(problem, values);
  std::vector<double> weights;
  double sum = 0.0;
  for (const double rmse : score.rmse_of_log_rad) {
    weights.push_back(1.0 / (rmse * rmse + kFloor * score.rmse_rad * score.rmse_rad));
    sum += weights.back();
  }
  if (!std::isfinite(sum)) return {};
  for (double& weight : weights) weight *= static_cast<double>(weights.size()) / sum;
  return weights;
}

/// The cost of the solution is that of equal weights, so that structures can be compared.
DriveSolution reweighted(const DriveProblem& problem, const DriveValues& start,
                         const DriveFitOptions& options) {
  DriveProblem weighted = problem;
  weighted.log_weights = weights_by_error(problem, start);
  DriveSolution best =
      descend(weighted, start, 0.0, std::span(kDifferences).last(2), 12, options.progress);
  best.cost = loss_of(problem, best.values, 0.0);
  return best;
}

/// Where a fall ends depends on friction so steeply that a search from afar stays there: recordings with power first.
DriveSolution fit_two_masses(const DriveLogs& logs, const DriveTerms& terms,
                             const DriveFitOptions& options) {
  const DriveProblem problem = drive_problem(logs, terms, options);
  const DriveLogs powered = always_powered(logs);
  constexpr std::size_t kFewestPowered = 2;
  const bool begins_powered = powered.size() < logs.size() && powered.size() >= kFewestPowered;
  DriveValues values = search_springs(begins_powered ? powered : logs, terms, options).values;
  if (begins_powered) values = reweighted(problem, values, options).values;
  return reweighted(problem, values, options);
}

}  // namespace

DriveSolution fit_problem(const DriveProblem& problem, const DriveValues& typical,
                          const DriveFitOptions& options) {
  std::mt19937_64 random(options.seed);
  DriveSolution best{.values = typical, .cost = HUGE_VAL};
  const std::span<const double> differences(kDifferences);
  for (std::size_t k = 0; k < std::max<std::size_t>(options.starts, 1); ++k) {
    DriveValues values = k == 0 ? typical : random_start(problem, typical, random);
    values = descend(problem, values, 0.4, differences.first(1), 12, options.progress).values;
    values = descend(problem, values, 1.5, differences.first(2), 15, options.progress).values;
    best = better(best, descend(problem, values, 0.0, differences, 30, options.progress));
  }
  return best;
}

DriveLogs pointers_to(const std::vector<DriveLog>& logs) {
  DriveLogs all;
  all.reserve(logs.size());
  for (const DriveLog& log : logs) all.push_back(&log);
  return all;
}

double drive_step_s(const DriveTerms& terms, const DriveFitOptions& options) {
  if (options.step_s > 0.0) return options.step_s;
  return has(terms, DriveTerm::spring) ? 0.001 : 0.0025;
}

DriveTerms possible_terms(CommandKind kind, bool has_spring, bool fits_joint_inertia) {
  using enum DriveTerm;
  DriveTerms terms = drive_terms({base, delay, load_friction, load_stribeck, stribeck});
  if (has_winding(kind)) terms |= drive_terms({resistance_rise, duty_exponent});
  if (kind == CommandKind::goal_to_torque || kind == CommandKind::torque)
    terms |= drive_terms({speed_limit});
  if (has_spring) {
    terms |= drive_terms({spring, hysteresis, backlash, bearing, presliding});
    if (fits_joint_inertia) terms |= drive_terms({joint_inertia});
  } else {
    terms |= drive_terms({direction});
  }
  return terms;
}

DriveProblem drive_problem(const DriveLogs& logs, const DriveTerms& terms,
                           const DriveFitOptions& options) {
  DriveProblem problem{.logs = logs, .searched = {}, .log_weights = {}, .roll_out = {}};
  const double step_s = drive_step_s(terms, options);
  const DriveValues typical = typical_values(logs, terms);
  double inertia = HUGE_VAL;
  for (const DriveLog* log : logs) inertia = std::min(inertia, log->load.load.inertia_kg_m2);
  for (const DriveParameterInfo& info : drive_parameters()) {
    if (!is_searched(info, terms, logs.front()->kind)) continue;
    SearchedDriveParameter searched{.index = static_cast<std::size_t>(info.parameter),
                                    .lowest = info.lowest,
                                    .highest = info.highest,
                                    .is_positive = info.is_positive,
                                    .typical = at(typical, info.parameter)};
    // The integrator is stable below 2 / step.
    if (info.parameter == DriveParameter::stiffness && !has(terms, DriveTerm::joint_inertia))
      searched.highest = std::min(searched.highest, 0.25 * inertia / (step_s * step_s));
    // A law's own past is not known before it was computed.
    if (info.parameter == DriveParameter::delay &&
        logs.front()->kind == CommandKind::goal_to_torque)
      searched.lowest = 0.0;
    problem.searched.push_back(searched);
  }
  const RolloutOptions rollout{.terms = terms, .step_s = step_s, .integrator = options.integrator};
  problem.roll_out = [rollout](const DriveLog& log, const DriveRun& run,
                               const DriveLanes& parameters, double* angle_rad) {
    roll_out(log, run, parameters, rollout, {.angle_rad = angle_rad});
  };
  return problem;
}

DriveSolution fit_drive(const DriveLogs& logs, const DriveTerms& terms,
                        const DriveFitOptions& options) {
  if (has(terms, DriveTerm::spring)) return fit_two_masses(logs, terms, options);
  return fit_problem(drive_problem(logs, terms, options), typical_values(logs, terms), options);
}

DriveSolution refit_drive(const DriveLogs& logs, const DriveTerms& terms, const DriveValues& start,
                          const DriveFitOptions& options) {
  const DriveProblem problem = drive_problem(logs, terms, options);
  DriveValues values = typical_values(logs, terms);
  for (const SearchedDriveParameter& parameter : problem.searched) {
    const DriveParameterInfo& info = drive_parameters()[parameter.index];
    const bool was_neutral = start[parameter.index] == info.neutral && info.is_positive;
    if (!was_neutral)
      values[parameter.index] =
          std::clamp(start[parameter.index], parameter.lowest, parameter.highest);
  }
  if (has(terms, DriveTerm::spring)) return reweighted(problem, values, options);
  return descend(problem, values, 0.0, std::span(kDifferences).last(2), 12, options.progress);
}

}  // namespace torsio
