#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "core/running_mean.hpp"
#include "paper_figures.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/units.hpp"
#include "turned_sensor.hpp"

// Paper 002, Figures 3, 7 and 8. The motor turns the input exactly; the output is clamped, but for the state without
// a load.

namespace torsio {
namespace {

constexpr double kTurnStep_s = 5e-5;
constexpr std::size_t kLogEvery = 200;            // steps: 10 ms
constexpr double kPaperSpeed_rad_s = 1.0 / 60.0;  // 1 rad/min
constexpr double kQuickSpeed_rad_s = 0.1;
constexpr double kBelow_rad = rad_from_deg(10.0);
constexpr double kBeyond_rad = rad_from_deg(20.0);
constexpr double kSlipped_rad = 1e-4;

constexpr PaperFigure kPrintedUp = paper_figure("002", "Fig. 8", "positive direction", "twist");
constexpr PaperFigure kPrintedDown = paper_figure("002", "Fig. 8", "negative direction", "twist");

struct Trace {
  std::vector<double> time_s;
  std::vector<double> input_deg;
  std::vector<double> torque_Nm;
};

void add_state(QuantityTable& table, const char* condition, const DataSheet& sheet, bool is_clamped,
               double to_rad, double speed_rad_s) {
  TurnedSensor sensor(sheet, kTurnStep_s,
                      is_clamped ? std::nullopt : std::optional(sheet.joint.inertia_kg_m2.value));
  const double step_rad = speed_rad_s * kTurnStep_s;
  const auto steps = static_cast<std::size_t>(std::ceil(to_rad / step_rad));
  for (std::size_t n = 0; n < steps; ++n) sensor.step(static_cast<double>(n) * step_rad);
  sensor.step(to_rad);
  const auto row = [&](const char* quantity, double value, const char* unit) {
    table.rows.push_back(
        {.condition = condition, .quantity = quantity, .value = value, .unit = unit});
  };
  row("torque", sensor.torque_Nm(), "Nm");
  row("slip of the clutch", deg_from_rad(sensor.slip_rad()), "deg");
  row("angle of the output", deg_from_rad(sensor.output_rad()), "deg");
}

/// Figure 3: at rest, without load, with a load below that of the clutch, and above it.
void add_states(QuantityTable& table, double speed_rad_s) {
  const DataSheet sheet = data_sheet("rubber-clutch:designed");
  add_state(table, "Figure 3 (a), at rest", sheet, true, 0.0, speed_rad_s);
  add_state(table, "Figure 3 (b), turned without load", sheet, false, kBelow_rad, speed_rad_s);
  add_state(table, "Figure 3 (c), turned below the clutch's torque", sheet, true, kBelow_rad,
            speed_rad_s);
  add_state(table, "Figure 3 (d), turned beyond it", sheet, true, kBeyond_rad, speed_rad_s);
}

/// One direction of Figure 8.
struct Slip {
  double input_deg = kNotMeasured;  ///< from where the torque was 0
  double torque_Nm = kNotMeasured;
  double sliding_Nm = kNotMeasured;  ///< mean over the last 3 deg
};

/// Figure 8: slowly up beyond slip, then down beyond it.
std::pair<Slip, Slip> slow_turn(const DataSheet& sheet, double speed_rad_s, Trace& trace) {
  constexpr double kSliding_rad = rad_from_deg(3.0);
  TurnedSensor sensor(sheet, kTurnStep_s, std::nullopt);
  std::pair<Slip, Slip> slips;
  double input_rad = 0.0;
  std::size_t n = 0;
  for (const double direction : {1.0, -1.0}) {
    Slip& of = direction > 0.0 ? slips.first : slips.second;
    double largest_Nm = 0.0;
    RunningMean sliding_Nm;
    const double start_slip_rad = sensor.slip_rad();
    while (direction * input_rad < kBeyond_rad) {
      input_rad += direction * speed_rad_s * kTurnStep_s;
      sensor.step(input_rad);
      largest_Nm = std::max(largest_Nm, direction * sensor.torque_Nm());
      if (std::isnan(of.input_deg) && std::abs(sensor.slip_rad() - start_slip_rad) > kSlipped_rad) {
        // What slipped before does not turn the rubber.
        of.input_deg = deg_from_rad(input_rad - start_slip_rad);
        of.torque_Nm = direction * largest_Nm;
      }
      if (direction * input_rad > kBeyond_rad - kSliding_rad) sliding_Nm.add(sensor.torque_Nm());
      if (n++ % kLogEvery != 0) continue;
      trace.time_s.push_back(static_cast<double>(n) * kTurnStep_s);
      trace.input_deg.push_back(deg_from_rad(input_rad));
      trace.torque_Nm.push_back(sensor.torque_Nm());
    }
    of.sliding_Nm = sliding_Nm.mean();
  }
  return slips;
}

void add_slow_turn(Study& study, QuantityTable& table, const char* actuator, double speed_rad_s) {
  Trace trace;
  const auto [up, down] = slow_turn(data_sheet(actuator), speed_rad_s, trace);
  for (const bool is_up : {true, false}) {
    const Slip& slip = is_up ? up : down;
    const std::string condition =
        fmt::format("Figure 8, {}, {} direction", actuator, is_up ? "positive" : "negative");
    table.rows.push_back(
        {.condition = condition,
         .quantity = "angle of the input when the clutch slips",
         .value = slip.input_deg,
         .unit = "deg",
         .published = is_up ? kPrintedUp : kPrintedDown,
         .remark = "here with the twist of the cable, whose stiffness is assumed"});
    table.rows.push_back({.condition = condition,
                          .quantity = "torque when it slips",
                          .value = slip.torque_Nm,
                          .unit = "Nm",
                          .published = paper_figure("002", "Fig. 8", "clutch slips", "torque"),
                          .remark = "printed as about"});
    table.rows.push_back({.condition = condition,
                          .quantity = "mean torque while it slides",
                          .value = slip.sliding_Nm,
                          .unit = "Nm"});
  }
  study.figures.emplace_back(XyFigure{
      .title = fmt::format("Figure 8, {}", actuator),
      .x = {"time [s]"},
      .y = {"torque [Nm], angle of the input [50 deg]"},
      .series = {
          {.label = "torque", .role = CurveRole::measured, .x = trace.time_s, .y = trace.torque_Nm},
          {.label = "angle / 50", .x = trace.time_s, .y = [&] {
             std::vector<double> scaled = trace.input_deg;
             for (double& value : scaled) value /= 50.0;
             return scaled;
           }()}}});
}

/// The last period of a sine, on a sensor that has settled.
struct SineLoop {
  std::vector<double> input_deg;
  std::vector<double> torque_Nm;
  double up_Nm = kNotMeasured;    ///< where the input passes 0
  double down_Nm = kNotMeasured;  ///< and back
  double work_J = 0.0;
};

SineLoop sine_loop(const DataSheet& sheet, double amplitude_deg, double frequency_Hz,
                   std::size_t periods) {
  TurnedSensor sensor(sheet, kTurnStep_s, std::nullopt);
  const auto period = static_cast<std::size_t>(std::lround(0.5 / frequency_Hz / kTurnStep_s)) * 2;
  const std::size_t first = (periods - 1) * period;
  SineLoop loop;
  double before_rad = 0.0;
  for (std::size_t n = 1; n <= periods * period; ++n) {
    const double phase = static_cast<double>(n) / static_cast<double>(period);
    const double input_rad = rad_from_deg(amplitude_deg) * std::sin(2.0 * std::numbers::pi * phase);
    sensor.step(input_rad);
    const double change_rad = input_rad - std::exchange(before_rad, input_rad);
    if (n == first) loop.up_Nm = sensor.torque_Nm();
    if (n == first + period / 2) loop.down_Nm = sensor.torque_Nm();
    if (n <= first) continue;
    loop.work_J += sensor.torque_Nm() * change_rad;
    if (n % kLogEvery != 0) continue;
    loop.input_deg.push_back(deg_from_rad(input_rad));
    loop.torque_Nm.push_back(sensor.torque_Nm());
  }
  return loop;
}

/// Figure 7: loops at three frequencies and two amplitudes.
void add_loops(Study& study, QuantityTable& table, bool is_quick) {
  const DataSheet sheet = data_sheet("rubber-clutch");
  for (const double amplitude_deg : {4.0, 5.0}) {
    XyFigure figure{.title = fmt::format("Figure 7, {:g} deg", amplitude_deg),
                    .x = {"angle of the input [deg]"},
                    .y = {"torque [Nm]"},
                    .series = {}};
    for (const double frequency_Hz : {0.4, 0.7, 1.0}) {
      SineLoop loop = sine_loop(sheet, amplitude_deg, frequency_Hz, is_quick ? 2 : 4);
      const auto [lowest_Nm, highest_Nm] = std::ranges::minmax(loop.torque_Nm);
      const auto row = [&](const char* quantity, double value, const char* unit) {
        table.rows.push_back(
            {.condition = fmt::format("Figure 7, {:g} deg, {:g} Hz", amplitude_deg, frequency_Hz),
             .quantity = quantity,
             .value = value,
             .unit = unit});
      };
      row("highest torque", highest_Nm, "Nm");
      row("lowest torque", lowest_Nm, "Nm");
      row("width of the loop at 0 deg", loop.up_Nm - loop.down_Nm, "Nm");
      row("work of a loop", 1e3 * loop.work_J, "mJ");
      figure.series.push_back({.label = fmt::format("{:g} Hz", frequency_Hz),
                               .role = CurveRole::measured,
                               .x = std::move(loop.input_deg),
                               .y = std::move(loop.torque_Nm)});
    }
    study.figures.emplace_back(std::move(figure));
  }
}

}  // namespace

Study figures_002(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "the input turns, the output is clamped. States and slow turns: rubber and clutch by the "
          "equations of section II (designed), which do not use Figure 8, beside the sensor "
          "whose "
          "stiffness is that of Figure 8 (the default). Loops: sines of 0.4, 0.7 and 1 Hz with 4 "
          "and 5 deg",
      .unit = "Nm",
      .options = options,
      .plants = {study_plant("rubber-clutch"), study_plant("rubber-clutch:designed")}};
  const double speed_rad_s = options.is_quick ? kQuickSpeed_rad_s : kPaperSpeed_rad_s;
  QuantityTable table;
  report_progress(progress, 0.0, "states");
  add_states(table, speed_rad_s);
  report_progress(progress, 0.3, "loops");
  add_loops(study, table, options.is_quick);
  report_progress(progress, 0.5, "slow turns");
  add_slow_turn(study, table, "rubber-clutch:designed", speed_rad_s);
  add_slow_turn(study, table, "rubber-clutch", speed_rad_s);
  study.table = std::move(table);
  study.figure_columns = 2;
  return study;
}

}  // namespace torsio
