#include "check/draft/logger_styles.hpp"

namespace torsio::test {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kEncoderCounts = 16384.0;

using Cell = std::function<std::string(const JointState&)>;

/// scale * member + offset, with five decimals.
Cell scaled(double JointState::*member, double scale = 1.0, double offset = 0.0) {
  return [=](const JointState& state) {
    return fmt::format("{:.5f}", scale * (state.*member) + offset);
  };
}

Cell counts(double JointState::*member, double scale) {
  return [=](const JointState& state) { return fmt::format("{:.0f}", scale * (state.*member)); };
}

Cell constant(const std::string& text) {
  return [=](const JointState&) { return text; };
}

/// A sensor of a tenth of the rate.
Cell held_torque() {
  return [](const JointState& state) {
    return fmt::format("{:.3f}", joint_at(state.row / 10 * 10).torque_Nm);
  };
}

LoggerStyle labview() {
  return {
      .name = "LabVIEW measurement, decimal comma",
      .preamble =
          "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n"
          "Operator\tlab\nDate\t2024/03/01\n***End_of_Header***\t\n\n",
      .separator = '\t',
      .has_decimal_comma = true,
      .columns = {{"X_Value", "t_s", "s", scaled(&JointState::t_s)},
                  {"Motor position (deg)", "gear_angle_rad", "deg",
                   scaled(&JointState::motor_rad, kDegrees), 1.0, kStyleRatio},
                  {"Load position (deg)", "joint_angle_rad", "deg",
                   scaled(&JointState::joint_rad, kDegrees)},
                  {"Torque (N m)", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)},
                  {"Motor current (A)", "motor_current_A", "A", scaled(&JointState::current_A)}}};
}

LoggerStyle dspace() {
  const std::string root = "Platform()://Model Root/";
  return {
      .name = "dSPACE ControlDesk",
      .preamble = "Recorder 1\nDSPACE;5.6\n",
      .separator = ';',
      .columns = {
          {"Time [s]", "t_s", "s", scaled(&JointState::t_s)},
          {root + "MotorEncoder/q_m/Out1", "gear_angle_rad", "rad", scaled(&JointState::motor_rad),
           1.0, kStyleRatio},
          {root + "LinkEncoder/q_l/Out1", "joint_angle_rad", "rad", scaled(&JointState::joint_rad)},
          {root + "TorqueSensor/tau_s/Out1", "torque_Nm", "Nm",
           scaled(&JointState::torque_Nm, -1.0), -1.0},
          {root + "Inverter/i_q/Out1", "motor_current_A", "A", scaled(&JointState::current_A)}}};
}

LoggerStyle matlab() {
  return {.name = "MATLAB writetimetable",
          .preamble = "",
          .columns = {
              {"Time", "t_s", "",
               [](const JointState& state) { return fmt::format("{:.3f} sec", state.t_s); }},
              {"MotorPosDeg", "gear_angle_rad", "deg", scaled(&JointState::motor_rad, kDegrees),
               1.0, kStyleRatio},
              {"JointPosDeg", "joint_angle_rad", "deg", scaled(&JointState::joint_rad, kDegrees)},
              {"JointVelDegPerSec", "joint_speed_rad_s", "deg_s",
               scaled(&JointState::joint_rad_s, kDegrees)},
              {"TauMeas", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)},
              {"TauDes", "goal_torque_Nm", "Nm", scaled(&JointState::torque_Nm, 1.0, 0.5)}}};
}

LoggerStyle plotjuggler() {
  return {
      .name = "PlotJuggler of ROS 2",
      .preamble = "",
      .columns = {
          {"__time", "t_s", "s",
           [](const JointState& state) { return fmt::format("{:.6f}", 1709294400.0 + state.t_s); }},
          {"/motor_states/elbow/position", "gear_angle_rad", "rad", scaled(&JointState::motor_rad),
           1.0, kStyleRatio},
          {"/joint_states/elbow/position", "joint_angle_rad", "rad",
           scaled(&JointState::joint_rad)},
          {"/joint_states/elbow/velocity", "joint_speed_rad_s", "rad_s",
           scaled(&JointState::joint_rad_s)},
          {"/joint_states/elbow/effort", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)}}};
}

LoggerStyle odrive() {
  return {.name = "ODrive",
          .preamble = "",
          .columns = {{"timestamp_ms", "t_s", "ms", scaled(&JointState::t_s, 1e3)},
                      {"axis0.encoder.pos_estimate", "gear_angle_rad", "rev",
                       scaled(&JointState::motor_rad, 1.0 / kTurn), 1.0, kStyleRatio},
                      {"axis0.encoder.vel_estimate", "motor_speed_rad_s", "rev_s",
                       scaled(&JointState::motor_rad_s, 1.0 / kTurn)},
                      {"axis0.motor.current_control.Iq_measured", "motor_current_A", "A",
                       scaled(&JointState::current_A)},
                      {"load_angle_deg", "joint_angle_rad", "deg",
                       scaled(&JointState::joint_rad, kDegrees)},
                      {"torque_sensor_Nm", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)}}};
}

LoggerStyle moteus() {
  return {.name = "moteus, with a load cell",
          .preamble = "",
          .columns = {{"time", "t_s", "s", scaled(&JointState::t_s)},
                      {"mode", "", "", constant("10")},
                      {"position", "gear_angle_rad", "rev",
                       scaled(&JointState::motor_rad, 1.0 / kTurn), 1.0, kStyleRatio},
                      {"velocity", "motor_speed_rad_s", "rev_s",
                       scaled(&JointState::motor_rad_s, 1.0 / kTurn)},
                      {"torque", "motor_torque_Nm", "Nm", scaled(&JointState::current_A, 0.11)},
                      {"q_current", "motor_current_A", "A", scaled(&JointState::current_A)},
                      {"d_current", "", "", constant("0.01")},
                      {"voltage", "drive_supply_V", "V", constant("24.1")},
                      {"temperature", "temperature_K", "degC", constant("31.5")},
                      {"fault", "", "", constant("0")},
                      {"loadcell_torque", "torque_Nm", "Nm", held_torque(), 1.0, 1.0, true},
                      {"output_angle_deg", "joint_angle_rad", "deg",
                       scaled(&JointState::joint_rad, kDegrees)}}};
}

LoggerStyle microcontroller() {
  return {.name = "microcontroller, counts",
          .preamble = "# teensy 4.1, loop 250 Hz\n",
          .columns = {{"micros", "t_s", "us", counts(&JointState::t_s, 1e6)},
                      {"enc_motor", "gear_angle_rad", "",
                       counts(&JointState::motor_rad, kEncoderCounts / kTurn)},
                      {"enc_joint", "joint_angle_rad", "",
                       counts(&JointState::joint_rad, kEncoderCounts / kTurn)},
                      {"tau", "torque_Nm", "Nm", held_torque()},
                      {"neu", "torque_fresh_1", "1",
                       [](const JointState& state) {
                         return std::string(state.row % 10 == 0 ? "1" : "0");
                       }},
                      {"note", "", "", constant("ok")}}};
}

LoggerStyle spreadsheet() {
  return {
      .name = "German spreadsheet",
      .preamble =
          "Pr\xc3\xbc"
          "fstand 3;Versuch 12\n",
      .separator = ';',
      .has_decimal_comma = true,
      .columns = {{"Zeit [ms]", "t_s", "ms", scaled(&JointState::t_s, 1e3)},
                  {"Winkel Motor [\xc2\xb0]", "gear_angle_rad", "deg",
                   scaled(&JointState::motor_rad, -kDegrees), -1.0, kStyleRatio},
                  {"Winkel Abtrieb [\xc2\xb0]", "joint_angle_rad", "deg",
                   scaled(&JointState::joint_rad, kDegrees)},
                  {"Drehmoment [Nm]", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)},
                  {"Soll-Drehmoment [Nm]", "goal_torque_Nm", "Nm",
                   scaled(&JointState::torque_Nm, 1.0, 0.5)},
                  {"Strom [mA]", "motor_current_A", "mA", scaled(&JointState::current_A, 1e3)}}};
}

LoggerStyle script() {
  return {.name = "numpy script, letters",
          .preamble = "",
          .columns = {
              {"t", "t_s", "s", scaled(&JointState::t_s)},
              {"theta", "gear_angle_rad", "rad", scaled(&JointState::motor_rad), 1.0, kStyleRatio},
              {"q", "joint_angle_rad", "rad", scaled(&JointState::joint_rad)},
              {"dq", "joint_speed_rad_s", "rad_s", scaled(&JointState::joint_rad_s)},
              {"tau", "torque_Nm", "Nm", scaled(&JointState::torque_Nm)},
              {"i", "motor_current_A", "A", scaled(&JointState::current_A)}}};
}

}  // namespace

std::vector<LoggerStyle> logger_styles() {
  return {labview(), dspace(),          matlab(),      plotjuggler(), odrive(),
          moteus(),  microcontroller(), spreadsheet(), script()};
}

}  // namespace torsio::test
