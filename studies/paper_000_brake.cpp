#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "paper_figures.hpp"
#include "sim/plant/plant.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr std::array kActuators{"dfki-28", "dfki-50", "dfki-120", "dfki-300"};

// The person: 150 N at 0.5 m, reached in 0.5 s and kept for 1 s.
constexpr double kPush_N = 150.0;
constexpr double kLever_m = 0.5;
constexpr int kPushRise = 500;
constexpr int kPushTicks = 1500;

// The stop: a lever whose weight is 0.3 of the rating, lifted from 1.2 rad at 0.5 rad/s for 0.5 s.
constexpr double kGravityShare = 0.3;
constexpr double kStart_rad = 1.2;
constexpr double kSpeed_rad_s = 0.5;
constexpr double kDeceleration_rad_s2 = 5.0;
constexpr int kMoveTicks = 500;
constexpr int kStopTicks = 3000;

void require_taken(Fault fault) {
  if (fault != Fault::none)
    throw Error({.place = "000-brake", .problem = "the plant refuses its load"});
}

void add_push(QuantityTable& table, const char* actuator) {
  const DataSheet sheet = data_sheet(actuator);
  Plant plant(plant_parameters(sheet));
  plant.use(brake_parameters(sheet));
  Load load;
  require_taken(plant.reset(0.0, load));
  const double slides_at_rad = 10.0 * brake_parameters(sheet).bristle_rad;
  double largest_rad = 0.0;
  bool slides = false;
  for (int n = 0; n < kPushTicks && !slides; ++n) {
    load.external_torque_Nm = kPush_N * kLever_m * std::min(1.0, n / double{kPushRise});
    require_taken(plant.step({.is_powered = false}, load, 1.0 / kRate_Hz));
    largest_rad = std::max(largest_rad, plant.state().joint_angle_rad);
    slides = std::abs(plant.state().rotor_angle_rad) > slides_at_rad;
  }
  const std::string condition = fmt::format("{}, {:.0f} N at {} m", actuator, kPush_N, kLever_m);
  table.rows.push_back(
      {.condition = condition,
       .quantity =
           slides ? "angle of the braked link when its brake slides" : "angle of the braked link",
       .value = deg_from_rad(largest_rad),
       .unit = "deg",
       .published = paper_figure("000", "section 3.1", "braked joint and a trapped person",
                                 "spring movement")});
  if (slides)
    table.rows.push_back({.condition = condition,
                          .quantity = "force at which the brake slides",
                          .value = load.external_torque_Nm / kLever_m,
                          .unit = "N"});
}

/// A joint with its controller, its stop and its brake.
class StoppedJoint {
 public:
  explicit StoppedJoint(const DataSheet& sheet)
      : joint_(series_elastic_joint(sheet)),
        load_(lever(kGravityShare * sheet.rating.torque_Nm.value / (9.81 * kLever_m), kLever_m)),
        plant_(plant_parameters(sheet)),
        brake_(brake_parameters(sheet)),
        controller_(LinearInverse(joint_.stiffness_Nm_rad), controller_settings(sheet), kRate_Hz),
        stop_(stop_settings(), kRate_Hz),
        speed_(kRate_Hz, 120.0) {
    plant_.use(brake_);
    plant_.set_brake(false);
    require_taken(plant_.reset(kStart_rad, load_));
  }

  JointStop::Output tick() {
    const PlantState& state = plant_.state();
    const JointState measured = {
        .angle_rad = state.rotor_angle_rad / joint_.drive.ratio,
        .speed_rad_s = speed_.step(state.rotor_angle_rad / joint_.drive.ratio),
        .torque_Nm = joint_.stiffness_Nm_rad * (state.middle_angle_rad - state.joint_angle_rad)};
    const JointReference wanted = {.mode = JointMode::velocity, .velocity_rad_s = kSpeed_rad_s};
    const auto output = controller_.step(stop_.reference(wanted, measured),
                                         {.motor_angle_rad = state.rotor_angle_rad,
                                          .gear_angle_rad = state.middle_angle_rad,
                                          .joint_angle_rad = state.joint_angle_rad});
    const JointStop::Output stopped = stop_.step(output.current_A, measured, output.fault);
    if (stopped.is_current_cut) controller_.track(stopped.current_A);
    require_taken(plant_.step({.current_A = stopped.current_A,
                               .is_powered = stopped.is_powered,
                               .brake_V = stopped.is_brake_open ? brake_.activation_V : 0.0},
                              load_, 1.0 / kRate_Hz));
    return stopped;
  }
  void trigger(StopCategory category) { stop_.trigger(category); }

  [[nodiscard]] double energy_J() const { return plant_.stored_energy(load_).all_J; }
  [[nodiscard]] double joint_rad() const { return plant_.state().joint_angle_rad; }

 private:
  [[nodiscard]] JointControllerCore::Settings controller_settings(const DataSheet& sheet) const {
    const double rated_Nm = joint_.drive.rated_current_A * joint_.drive.torque_per_current();
    return {.torque = {.deflection = {.joint = joint_}},
            .limits = {.speed_rad_s = sheet.rating.speed_rad_s.value,
                       .max_unmeasured_load_Nm = 0.05 * rated_Nm,
                       .max_measured_load_Nm = 0.6 * rated_Nm}};
  }
  [[nodiscard]] JointStop::Settings stop_settings() const {
    const double ratio = joint_.drive.ratio;
    return {.drive = joint_.drive,
            .speed_rad_s = kSpeed_rad_s,
            .deceleration_rad_s2 = kDeceleration_rad_s2,
            .brake_static_Nm = brake_.static_Nm * ratio,
            .brake_sliding_Nm = brake_.sliding_Nm * ratio,
            .brake_engage_s = brake_.engage_s,
            .brake_release_s = brake_.release_s,
            .load_Nm = load_.gravity_Nm};
  }

  SeriesElasticJoint joint_;
  Load load_;
  Plant plant_;
  Brake::Parameters brake_;
  JointController<LinearInverse> controller_;
  JointStop stop_;
  Differentiator speed_;
};

void add_stop(QuantityTable& table, const char* actuator, StopCategory category) {
  StoppedJoint joint(data_sheet(actuator));
  for (int n = 0; n < kMoveTicks; ++n) (void)joint.tick();
  joint.trigger(category);
  const double first_rad = joint.joint_rad();
  const double first_J = joint.energy_J();
  double max_J = first_J;
  double farthest_rad = first_rad;
  double rest_s = 0.0;
  JointStop::Output output;
  for (int n = 0; n < kStopTicks; ++n) {
    output = joint.tick();
    max_J = std::max(max_J, joint.energy_J());
    farthest_rad = std::max(farthest_rad, joint.joint_rad());
    if (!output.is_drive_at_rest) rest_s = (n + 1) / kRate_Hz;
  }
  const std::string condition =
      fmt::format("{}, lifting, category {}", actuator, static_cast<int>(category));
  const auto add = [&](std::string quantity, double value, std::string unit) {
    table.rows.push_back({.condition = condition,
                          .quantity = std::move(quantity),
                          .value = value,
                          .unit = std::move(unit)});
  };
  add("time until the drive is at rest", output.is_drive_at_rest ? rest_s : kNotMeasured, "s");
  add("largest angle of the link after the trigger", deg_from_rad(farthest_rad - first_rad), "deg");
  add("angle of the link after 3 s", deg_from_rad(joint.joint_rad() - first_rad), "deg");
  add("largest gain of energy", 1e3 * (max_J - first_J), "mJ");
}

}  // namespace

Study brake_000(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "a person pushes a braked link without power; a lever is lifted at 0.5 "
                  "rad/s, its weight 0.3 of the rating, and stopped at 5 rad/s2. All "
                  "values of the brakes but the voltage are assumed",
              .unit = "",
              .options = options};
  QuantityTable table;
  for (const char* const actuator : kActuators) {
    study.plants.push_back(study_plant(actuator));
    add_push(table, actuator);
  }
  for (std::size_t i = 0; i < kActuators.size(); ++i) {
    report_progress(progress, static_cast<double>(i) / kActuators.size(), kActuators[i]);
    for (const StopCategory category :
         {StopCategory::power_off, StopCategory::ramp_and_brake, StopCategory::ramp_and_hold})
      add_stop(table, kActuators[i], category);
  }
  study.table = std::move(table);
  study.notes.emplace_back(
      "The paper states neither force nor lever (\"approximately\" 5 deg). Nothing limits the "
      "deflection "
      "of these springs. The runs have no noise: seed and repeats have no effect.");
  study.notes.emplace_back(
      "Angles are from the trigger on: a lifted link stops by its weight and sinks. Category 0 is "
      "the "
      "fastest: the brake is stronger than the ramp. Rest is reported 0.02 s after it began.");
  return study;
}

}  // namespace torsio
