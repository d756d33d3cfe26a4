#include "torsio/identify/drive/drive_model.hpp"

#include <algorithm>

#include "core/did_you_mean.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using enum DriveParameter;
using Term = DriveTerm;

// The ranges are wide priors of a small servo up to a joint of 300 Nm; results at a bound are reported.
constexpr std::array<DriveParameterInfo, kDriveParameters> kParameters{{
    {torque_constant, Term::base, "torque_constant_Nm_A", "torque of the joint for each ampere",
     0.0, 0.02, 1e3, true},
    {resistance, Term::base, "resistance_ohm", "resistance of the winding", 1.0, 0.01, 50.0, true},
    {armature, Term::base, "armature_kg_m2", "inertia of the motor", 0.0, 1e-5, 50.0, true},
    {zero, Term::base, "zero_rad", "angle of the load at the joint's zero", 0.0, -0.2, 0.2, false},
    {coulomb, Term::base, "coulomb_Nm", "dry friction without load", 0.0, 1e-5, 200.0, true},
    {viscous, Term::base, "viscous_Nms_rad", "viscous friction", 0.0, 1e-5, 200.0, true},
    {delay, Term::delay, "delay_s", "delay of the command", 0.0, -0.01, 0.03, false},
    {load_friction, Term::load_friction, "load_friction_1", "dry friction for each Nm of load", 0.0,
     1e-4, 1.0, true},
    {load_stribeck, Term::load_stribeck, "load_stribeck_1", "the same, at rest only", 0.0, 1e-4,
     2.0, true},
    {load_speed, Term::load_stribeck, "load_speed_rad_s", "speed at which that has fallen to 37 %",
     1.0, 0.005, 20.0, true},
    {stribeck, Term::stribeck, "stribeck_Nm", "further dry friction at rest", 0.0, 1e-5, 200.0,
     true},
    {stribeck_speed, Term::stribeck, "stribeck_speed_rad_s",
     "speed at which that has fallen to 37 %", 1.0, 0.005, 20.0, true},
    {resistance_rise, Term::resistance_rise, "resistance_rise_ohm",
     "further resistance at full duty", 0.0, 1e-3, 50.0, true},
    {duty_exponent, Term::duty_exponent, "duty_exponent_1", "exponent of the duty", 1.0, 0.3, 3.0,
     true},
    {no_load_speed, Term::speed_limit, "no_load_speed_rad_s",
     "speed at which the supply leaves no torque", 1e6, 0.05, 1e3, true},
    {stall_torque, Term::speed_limit, "stall_torque_Nm", "torque that the supply can give at rest",
     1e6, 0.05, 1e5, true},
    {direction, Term::direction, "direction_1",
     "share by which the motor's torque counts more as load than gravity's", 0.0, -1.0, 1.0, false},
    {joint_inertia, Term::joint_inertia, "joint_inertia_kg_m2", "inertia of the joint's output",
     0.0, 1e-5, 50.0, true},
    {stiffness, Term::spring, "stiffness_Nm_rad", "stiffness of the spring", 0.0, 1.0, 1e6, true},
    {spring_damping, Term::spring, "spring_damping_Nms_rad", "damping of the spring", 0.0, 1e-6,
     1e3, true},
    {hysteresis, Term::hysteresis, "hysteresis_Nm", "half height of the spring's hysteresis", 0.0,
     1e-5, 200.0, true},
    {hysteresis_width, Term::hysteresis, "hysteresis_width_rad",
     "deflection over which it builds up", 1.0, 1e-6, 0.2, true},
    {backlash, Term::backlash, "backlash_rad", "half width of the backlash", 0.0, 1e-7, 0.1, true},
    {bearing, Term::bearing, "bearing_Nm", "dry friction of the joint's bearing", 0.0, 1e-5, 200.0,
     true},
    {bearing_viscous, Term::bearing, "bearing_viscous_Nms_rad", "viscous friction of that bearing",
     0.0, 1e-5, 200.0, true},
    {presliding, Term::presliding, "presliding_rad", "angle over which dry friction builds up", 0.0,
     1e-6, 0.05, true},
}};

// A parameter is the number of its row.
static_assert([] {
  for (std::size_t row = 0; row < kDriveParameters; ++row)
    if (kParameters[row].parameter != static_cast<DriveParameter>(row)) return false;
  return true;
}());

constexpr std::array<std::string_view, kDriveTerms> kTermNames{
    "base",          "delay",       "load_friction", "load_stribeck", "stribeck", "resistance_rise",
    "duty_exponent", "speed_limit", "direction",     "joint_inertia", "spring",   "hysteresis",
    "backlash",      "bearing",     "presliding"};

}  // namespace

std::string_view name(DriveTerm term) { return kTermNames[static_cast<std::size_t>(term)]; }

DriveTerms drive_terms(std::initializer_list<DriveTerm> terms) {
  DriveTerms set;
  for (const DriveTerm term : terms) set.set(static_cast<std::size_t>(term));
  return set;
}

DriveTerms drive_terms_named(std::span<const std::string> names, const std::string& place,
                             const std::string& expected) {
  DriveTerms terms = drive_terms({DriveTerm::base});
  for (const std::string& wanted : names) {
    const auto* const found = std::ranges::find(kTermNames, wanted);
    if (found == kTermNames.end())
      throw UsageError({.place = place,
                        .expected = expected + joined(std::vector<std::string>(kTermNames.begin(),
                                                                               kTermNames.end())),
                        .found = wanted,
                        .advice = did_you_mean(wanted, kTermNames)});
    terms.set(static_cast<std::size_t>(found - kTermNames.begin()));
  }
  return terms;
}

std::span<const DriveParameterInfo, kDriveParameters> drive_parameters() { return kParameters; }

const DriveParameterInfo& drive_parameter_info(DriveParameter parameter) {
  return kParameters[static_cast<std::size_t>(parameter)];
}

DriveValues neutral_drive_values() {
  DriveValues values{};
  for (const DriveParameterInfo& info : kParameters) at(values, info.parameter) = info.neutral;
  return values;
}

}  // namespace torsio
