#pragma once

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace torsio::test {

/// A joint with an elastic element, after a gear, at one moment; SI.
struct JointState {
  double t_s = 0.0;
  double motor_rad = 0.0;  ///< before the gear
  double motor_rad_s = 0.0;
  double joint_rad = 0.0;
  double joint_rad_s = 0.0;
  double torque_Nm = 0.0;
  double current_A = 0.0;
  int row = 0;
};

inline constexpr double kStyleRate_Hz = 250.0;
inline constexpr double kStyleRatio = 101.0;
inline constexpr int kStyleRows = 1500;

inline JointState joint_at(int row) {
  constexpr double kStiffness_Nm_rad = 350.0;
  constexpr double kTorquePerA = 0.11 * kStyleRatio;
  const double t = static_cast<double>(row) / kStyleRate_Hz;
  const double a = 2.0 * std::numbers::pi * 0.31;
  const double b = 2.0 * std::numbers::pi * 1.13;
  const double c = 2.0 * std::numbers::pi * 0.47;
  JointState state{.t_s = t, .row = row};
  state.joint_rad = 0.6 * std::sin(a * t) + 0.12 * std::sin(b * t);
  state.joint_rad_s = 0.6 * a * std::cos(a * t) + 0.12 * b * std::cos(b * t);
  state.torque_Nm = 12.0 * std::sin(c * t + 0.4) + 3.0 * std::sin(b * t);
  const double torque_rate = 12.0 * c * std::cos(c * t + 0.4) + 3.0 * b * std::cos(b * t);
  state.motor_rad = kStyleRatio * (state.joint_rad + state.torque_Nm / kStiffness_Nm_rad);
  state.motor_rad_s = kStyleRatio * (state.joint_rad_s + torque_rate / kStiffness_Nm_rad);
  state.current_A = state.torque_Nm / kTorquePerA + (state.motor_rad_s > 0.0 ? 0.08 : -0.08);
  return state;
}

/// What a column is, and how a logger writes it.
struct StyledColumn {
  std::string name;
  std::string channel;  ///< the right guess; empty: none
  std::string unit;     ///< the right unit; empty: only the user can state it
  std::function<std::string(const JointState&)> cell;
  double sign = 1.0;
  double gear_ratio = 1.0;
  bool holds = false;
};

/// A manner of writing logs.
struct LoggerStyle {
  std::string name;
  std::string preamble;
  char separator = ',';
  bool has_decimal_comma = false;
  std::vector<StyledColumn> columns;

  [[nodiscard]] std::string text() const {
    std::string text = preamble;
    const auto add_line = [&](const auto& cell_of) {
      for (std::size_t i = 0; i < columns.size(); ++i)
        text += (i == 0 ? "" : std::string(1, separator)) + cell_of(columns[i]);
      text += '\n';
    };
    add_line([](const StyledColumn& column) { return column.name; });
    for (int row = 0; row < kStyleRows; ++row) {
      const JointState state = joint_at(row);
      add_line([&](const StyledColumn& column) {
        std::string cell = column.cell(state);
        if (has_decimal_comma)
          for (char& c : cell) c = c == '.' ? ',' : c;
        return cell;
      });
    }
    return text;
  }
};

/// As they write names and units: LabVIEW, dSPACE ControlDesk, a MATLAB timetable, PlotJuggler, ODrive, moteus, a
/// microcontroller, a German spreadsheet, a script of numpy.
[[nodiscard]] std::vector<LoggerStyle> logger_styles();

}  // namespace torsio::test
