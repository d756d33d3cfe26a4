#include "identify/drive/bam_rollout.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace torsio {
namespace {

enum Row : std::size_t {
  row_kt,
  row_resistance,
  row_armature,
  row_offset,
  row_base,
  row_viscous,
  row_stribeck,
  row_speed,
  row_alpha,
  row_load,
  row_load_stribeck,
  row_motor,
  row_external,
  row_motor_stribeck,
  row_external_stribeck,
  row_motor_quad,
  row_external_quad,
  row_count
};

// The ranges are those in which BAM searches.
constexpr std::array<BamParameter, row_count> kBamParameters{{
    {"kt", 0.1, 3.0, 0.5, true},
    {"R", 0.5, 10.0, 3.0, true},
    {"armature", 1e-4, 0.05, 2e-3, true},
    {"q_offset", -0.1, 0.1, 0.0, false},
    {"friction_base", 1e-5, 0.2, 0.02, true},
    {"friction_viscous", 1e-5, 1.0, 0.01, true},
    {"friction_stribeck", 1e-5, 0.2, 0.01, true},
    {"dtheta_stribeck", 0.1, 3.0, 0.5, true},
    {"alpha", 1.0, 10.0, 1.3, true},
    {"load_friction_base", 1e-5, 0.5, 0.05, true},
    {"load_friction_stribeck", 1e-5, 1.0, 0.05, true},
    {"load_friction_motor", 1e-5, 0.5, 0.05, true},
    {"load_friction_external", 1e-5, 0.5, 0.05, true},
    {"load_friction_motor_stribeck", 1e-5, 1.0, 0.05, true},
    {"load_friction_external_stribeck", 1e-5, 1.0, 0.05, true},
    {"load_friction_motor_quad", 1e-6, 0.01, 1e-3, true},
    {"load_friction_external_quad", 1e-6, 0.01, 1e-3, true},
}};
static_assert(row_count <= kDriveParameters);

struct BamTerms {
  bool load;
  bool stribeck;
  bool directional;
  bool quadratic;
};
constexpr std::array<BamTerms, kBamModels> kTerms{{{false, false, false, false},
                                                   {false, true, false, false},
                                                   {true, false, false, false},
                                                   {true, true, false, false},
                                                   {true, true, true, false},
                                                   {true, true, true, true}}};

double bound_of(const BamTerms& terms, const DriveLanes& p, std::size_t lane, double motor,
                double external, double speed) {
  const auto of = [&](Row row) { return p.of[row][lane]; };
  double bound = of(row_base) + of(row_viscous) * std::abs(speed);
  if (terms.load)
    bound += terms.directional ? std::abs(of(row_external) * external - of(row_motor) * motor)
                               : of(row_load) * std::abs(external - motor);
  if (!terms.stribeck) return bound;
  double at_rest = of(row_stribeck);
  if (terms.load)
    at_rest += terms.directional
                   ? std::abs(of(row_external_stribeck) * external - of(row_motor_stribeck) * motor)
                   : of(row_load_stribeck) * std::abs(external - motor);
  if (terms.quadratic && external * motor < 0.0)
    at_rest += std::abs(motor) > std::abs(external) ? of(row_external_quad) * external * external
                                                    : of(row_motor_quad) * motor * motor;
  return bound + at_rest * std::exp(-std::pow(std::abs(speed) / of(row_speed), of(row_alpha)));
}

}  // namespace

std::string_view name(BamModel model) {
  constexpr std::array<std::string_view, kBamModels> kNames{"m1", "m2", "m3", "m4", "m5", "m6"};
  return kNames[static_cast<std::size_t>(model)];
}

std::span<const BamParameter> bam_parameters() { return kBamParameters; }

std::vector<std::size_t> bam_rows(BamModel model) {
  const BamTerms& terms = kTerms[static_cast<std::size_t>(model)];
  std::vector<std::size_t> rows{row_kt,     row_resistance, row_armature,
                                row_offset, row_base,       row_viscous};
  const auto add = [&](std::initializer_list<std::size_t> more) { rows.insert(rows.end(), more); };
  if (terms.stribeck) add({row_stribeck, row_speed, row_alpha});
  if (terms.load && !terms.directional) add({row_load});
  if (terms.load && terms.stribeck && !terms.directional) add({row_load_stribeck});
  if (terms.directional) add({row_motor, row_external, row_motor_stribeck, row_external_stribeck});
  if (terms.quadratic) add({row_motor_quad, row_external_quad});
  return rows;
}

DriveTerms terms_of_bam(BamModel model) {
  const BamTerms& terms = kTerms[static_cast<std::size_t>(model)];
  DriveTerms all = drive_terms({DriveTerm::base});
  if (terms.stribeck) all |= drive_terms({DriveTerm::stribeck});
  if (terms.load) all |= drive_terms({DriveTerm::load_friction});
  if (terms.load && terms.stribeck) all |= drive_terms({DriveTerm::load_stribeck});
  if (terms.directional) all |= drive_terms({DriveTerm::direction});
  return all;
}

void roll_out_bam(BamModel model, const DriveLog& log, const DriveRun& run,
                  const DriveLanes& parameters, double* angle_rad) {
  const BamTerms& terms = kTerms[static_cast<std::size_t>(model)];
  const double dt = log.sample_period_s;
  const JointLoad& load = log.load.load;
  for (std::size_t lane = 0; lane < kDriveLanes; ++lane) {
    const auto of = [&](Row row) { return parameters.of[row][lane]; };
    double angle = run.angle_rad;
    double speed = run.speed_rad_s;
    const double inertia = load.inertia_kg_m2 + of(row_armature);
    for (std::size_t n = 0; n < run.samples; ++n) {
      angle_rad[n * kDriveLanes + lane] = angle;
      const std::size_t sample = run.first + n;
      const double external = -load.gravity_Nm * std::sin(angle + load.zero_rad + of(row_offset));
      const double duty =
          std::clamp(log.gain * (log.command[sample] - angle), -log.limit, log.limit);
      const bool is_on = is_powered(log, sample);
      const double motor =
          is_on ? of(row_kt) / of(row_resistance) * (log.supply_V * duty - of(row_kt) * speed)
                : 0.0;
      const double stopping = inertia / dt * speed + motor + external;
      const double bound = bound_of(terms, parameters, lane, motor, external, speed);
      const double acceleration =
          (motor + external - std::clamp(stopping, -bound, bound)) / inertia;
      constexpr double kFastest_rad_s = 100.0;
      speed = std::clamp(speed + acceleration * dt, -kFastest_rad_s, kFastest_rad_s);
      angle += speed * dt + 0.5 * acceleration * dt * dt;
    }
  }
}

DriveProblem bam_problem(const std::vector<const DriveLog*>& logs, BamModel model) {
  DriveProblem problem{.logs = logs, .searched = {}, .log_weights = {}, .roll_out = {}};
  for (const std::size_t row : bam_rows(model)) {
    const BamParameter& parameter = kBamParameters[row];
    problem.searched.push_back({.index = row,
                                .lowest = parameter.lowest,
                                .highest = parameter.highest,
                                .is_positive = parameter.is_positive,
                                .typical = parameter.typical});
  }
  problem.roll_out = [model](const DriveLog& log, const DriveRun& run, const DriveLanes& parameters,
                             double* angle_rad) {
    DriveRun start = run;
    if (run.first == 0)
      start = {.first = 0,
               .samples = run.samples,
               .angle_rad = log.angle_rad.front(),
               .speed_rad_s = 0.0};
    roll_out_bam(model, log, start, parameters, angle_rad);
  };
  return problem;
}

}  // namespace torsio
