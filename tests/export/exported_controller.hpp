#pragma once

#include <fmt/format.h>

#include <array>
#include <string>

#include "export/c_library.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio::test {

/// A controlled joint as a C program, compiled and loaded.
class ExportedController {
 public:
  struct Output {
    double current_A;
    double wanted_torque_Nm;
    double wanted_deflection_rad;
    double wanted_velocity_rad_s;
    double thermal_load;
    double motor_work_J;
    JointCascade::Limit limit;
    bool is_limited;
    bool is_reference_refused;
    Fault inverse;
    Fault fault;
    JointStop::Phase phase;
    bool is_powered;
    bool is_brake_open;
    bool is_drive_at_rest;
    bool has_escalated;
  };

  ExportedController(const TemporaryFolder& folder, const ModelFile& model,
                     const C99Options& options)
      : library_(folder, c99_program(model, options, "test.safetensors"), options.name,
                 wrapper(options, model)) {
    step_ = library_.symbol<Step>("around_step");
    trigger_ = library_.symbol<Trigger>("around_trigger");
    release_ = library_.symbol<Release>("around_release");
    set_limits_ = library_.symbol<Set>("around_set_limits");
    set_gains_ = library_.symbol<Set>("around_set_gains");
    reset_ = library_.symbol<Reset>("around_reset");
  }

  /// @param sample angles in SI or in counts; all are lost if the first is NaN
  Output step(const JointReference& wanted, const JointSample& sample) {
    const std::array<double, 9> reference{
        static_cast<double>(wanted.mode), wanted.position_rad,    wanted.velocity_rad_s,
        wanted.acceleration_rad_s2,       wanted.torque_Nm,       wanted.current_A,
        wanted.stiffness_Nm_rad,          wanted.damping_Nms_rad, wanted.deflection_rad};
    const bool is_lost = sample.motor_angle_rad != sample.motor_angle_rad;
    const std::array<double, 5> measured{
        is_lost ? 0.0 : sample.motor_angle_rad, is_lost ? 0.0 : sample.gear_angle_rad,
        is_lost ? 0.0 : sample.joint_angle_rad, is_lost ? 0.0 : sample.motor_current_A,
        is_lost ? 1.0 : 0.0};
    std::array<double, 16> out{};
    step_(reference.data(), measured.data(), out.data());
    return {.current_A = out[0],
            .wanted_torque_Nm = out[1],
            .wanted_deflection_rad = out[2],
            .wanted_velocity_rad_s = out[3],
            .thermal_load = out[4],
            .motor_work_J = out[5],
            .limit = static_cast<JointCascade::Limit>(out[6]),
            .is_limited = out[7] != 0.0,
            .is_reference_refused = out[8] != 0.0,
            .inverse = static_cast<Fault>(out[9]),
            .fault = static_cast<Fault>(out[10]),
            .phase = static_cast<JointStop::Phase>(out[11]),
            .is_powered = out[12] != 0.0,
            .is_brake_open = out[13] != 0.0,
            .is_drive_at_rest = out[14] != 0.0,
            .has_escalated = out[15] != 0.0};
  }
  void trigger(StopCategory category) { trigger_(static_cast<int>(category)); }
  bool release() { return release_() != 0; }
  bool set_limits(double lowest_rad, double highest_rad, double speed_rad_s, double torque_Nm) {
    return set_limits_(lowest_rad, highest_rad, speed_rad_s, torque_Nm) != 0;
  }
  bool set_gains(const JointCascade::Gains& gains) {
    return set_gains_(gains.position_1_s, gains.velocity.proportional, gains.velocity.integral,
                      gains.velocity.derivative) != 0;
  }
  void reset() { reset_(); }

 private:
  using Step = void (*)(const double*, const double*, double*);
  using Trigger = void (*)(int);
  using Release = int (*)();
  using Set = int (*)(double, double, double, double);
  using Reset = void (*)();

  static std::string wrapper(const C99Options& options, const ModelFile& model) {
    const std::string real = options.real == CReal::single ? "float" : "double";
    std::string zeros;
    for (const std::string& channel : model.settings.zeroed_channels)
      zeros += fmt::format("  if (!is_ready) {0}_set_zero_{1}(&control.spring.model, 0);\n",
                           options.name, channel);
    std::string sample;
    for (int i = 0; const char* const angle : {"motor", "gear", "joint"}) {
      bool is_counted = false;
      for (const CCounts& counts : options.counts)
        is_counted = is_counted || counts.channel == std::string(angle) + "_angle_rad";
      sample += is_counted
                    ? fmt::format("  measured.{}_counts = (int32_t)sample[{}];\n", angle, i)
                    : fmt::format("  measured.{}_angle_rad = ({})sample[{}];\n", angle, real, i);
      ++i;
    }
    std::string stop = fmt::format(
        R"c(void around_trigger(int category) {{ {0}_trigger_stop(&control, category); }}
int around_release(void) {{ return {0}_release_stop(&control); }}
)c",
        options.name);
    return fmt::format(R"c(#include "{0}.h"
static {0}_control control;
static int is_ready;
const uint32_t around_state_bytes = sizeof control;
void around_step(const double *reference, const double *sample, double *out) {{
  {0}_reference wanted;
  {0}_sample measured;
  {0}_command command;
{1}  is_ready = 1;
  wanted.mode = (int)reference[0];
  wanted.position_rad = ({3})reference[1];
  wanted.velocity_rad_s = ({3})reference[2];
  wanted.acceleration_rad_s2 = ({3})reference[3];
  wanted.torque_Nm = ({3})reference[4];
  wanted.current_A = ({3})reference[5];
  wanted.stiffness_Nm_rad = ({3})reference[6];
  wanted.damping_Nms_rad = ({3})reference[7];
  wanted.deflection_rad = ({3})reference[8];
{2}  measured.motor_current_A = ({3})sample[3];
  measured.is_lost = (int)sample[4];
  {0}_control_step(&control, &wanted, &measured, &command);
  out[0] = command.current_A;
  out[1] = command.wanted_torque_Nm;
  out[2] = command.wanted_deflection_rad;
  out[3] = command.wanted_velocity_rad_s;
  out[4] = command.thermal_load;
  out[5] = command.motor_work_J;
  out[6] = command.limit;
  out[7] = command.is_limited;
  out[8] = command.is_reference_refused;
  out[9] = command.inverse_fault;
  out[10] = command.fault;
  out[11] = command.phase;
  out[12] = command.is_powered;
  out[13] = command.is_brake_open;
  out[14] = command.is_drive_at_rest;
  out[15] = command.has_escalated;
}}
{4}int around_set_limits(double lowest, double highest, double speed, double torque) {{
  return {0}_set_limits(&control, ({3})lowest, ({3})highest, ({3})speed, ({3})torque);
}}
int around_set_gains(double position, double proportional, double integral, double derivative) {{
  {0}_gains gains;
  gains.proportional = ({3})proportional;
  gains.integral = ({3})integral;
  gains.derivative = ({3})derivative;
  return {0}_set_gains(&control, ({3})position, &gains);
}}
void around_reset(void) {{ {0}_control_reset(&control); }}
)c",
                       options.name, zeros, sample, real, stop);
  }

  CLibrary library_;
  Step step_ = nullptr;
  Trigger trigger_ = nullptr;
  Release release_ = nullptr;
  Set set_limits_ = nullptr;
  Set set_gains_ = nullptr;
  Reset reset_ = nullptr;
};

}  // namespace torsio::test
