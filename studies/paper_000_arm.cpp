#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arm_trajectory.hpp"
#include "core/running_mean.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "paper_figures.hpp"
#include "report/html/arm_figures.hpp"
#include "sim/plant/plant.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSegments = 24;
constexpr std::size_t kQuickSegments = 10;
constexpr std::uint64_t kTest = 50;  // distance of the seeds of test trajectories
constexpr double kShown_s = 40.0;    // in the figure
constexpr double kShownBin_s = 0.1;
constexpr std::size_t kShownConfigurations = 6;

/// A coefficient of (18) or (19) in the paper's unit.
struct Coefficient {
  const char* name;
  const char* unit;
  double scale;  ///< from SI
  double DeflectionTorque::*value;
};
constexpr std::array kCoefficients{
    Coefficient{"p0", "Nm", 1.0, &DeflectionTorque::offset_Nm},
    Coefficient{"p1", "Nm/deg", rad_from_deg(1.0), &DeflectionTorque::stiffness_Nm_rad},
    Coefficient{"p2", "Nm/(deg/s)", rad_from_deg(1.0), &DeflectionTorque::viscous_Nms_rad},
    Coefficient{"p3", "Nm", 1.0, &DeflectionTorque::coulomb_Nm}};

/// One of the two regressions of a joint.
struct TorqueSource {
  const char* name;
  DeflectionTorqueFit MotorReferencedFit::*fit;
  DeflectionTorque MotorReferencedTorques::Parameters::*parameters;
};
constexpr std::array kSources{
    TorqueSource{"spring", &MotorReferencedFit::spring,
                 &MotorReferencedTorques::Parameters::spring},
    TorqueSource{"gear", &MotorReferencedFit::gear, &MotorReferencedTorques::Parameters::gear}};

/// Table 3. A coefficient that paper_figures.csv does not have ends the build.
template <std::size_t... I>
consteval auto table_3(std::index_sequence<I...> /*rows*/) {
  constexpr std::size_t kRows = kCoefficients.size();
  constexpr std::array kNames{"p0 spring", "p1 spring", "p2 spring", "p3 spring",
                              "p0 gear",   "p1 gear",   "p2 gear",   "p3 gear"};
  return std::array{
      paper_figure("000", "Table 3", kArm[I / (2 * kRows)].joint, kNames[I % (2 * kRows)])...};
}
constexpr auto kTable3 = table_3(std::make_index_sequence<kArmJoints * 2 * kCoefficients.size()>());

const PaperFigure& printed(std::size_t joint, std::size_t source, std::size_t coefficient) {
  return kTable3[(joint * kSources.size() + source) * kCoefficients.size() + coefficient];
}

/// The joint's torques with the printed coefficients.
MotorReferencedTorques::Parameters printed_parameters(
    std::size_t joint, MotorReferencedTorques::Parameters parameters) {
  for (std::size_t s = 0; s < kSources.size(); ++s)
    for (std::size_t c = 0; c < kCoefficients.size(); ++c)
      parameters.*kSources[s].parameters.*kCoefficients[c].value =
          printed(joint, s, c).value / kCoefficients[c].scale;
  return parameters;
}

/// What the sensors of a joint give, sample by sample.
struct JointLog {
  std::vector<double> t_s, angle_deg, speed_deg_s, motor_Nm, gear_Nm, spring_Nm;
  std::vector<double> gear_load_Nm, spring_load_Nm;
  std::vector<double> load_cell_Nm;  ///< not measured where the cell has no new sample
};

JointLog log_of(const Recording& recording, const MotorReferencedTorques::Parameters& parameters) {
  MotorReferencedTorques torques(parameters);
  Differentiator rate(recording.sample_rate_Hz(), TorqueRegressionOptions().speed_cutoff_Hz);
  const auto at = [&](const char* name, std::size_t n) {
    return recording.channel(name).values[n];
  };
  const Channel& cell = recording.channel("torque_Nm");
  JointLog log;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    const JointSample sample{.motor_angle_rad = at("motor_angle_rad", n),
                             .gear_angle_rad = at("gear_angle_rad", n),
                             .joint_angle_rad = at("joint_angle_rad", n),
                             .motor_current_A = at("motor_current_A", n)};
    const double speed_rad_s = rate.step(sample.joint_angle_rad);
    if (!rate.is_settled()) continue;
    const auto output = torques.step(sample, speed_rad_s);
    log.t_s.push_back(recording.time_s(n));
    log.angle_deg.push_back(deg_from_rad(sample.joint_angle_rad));
    log.speed_deg_s.push_back(deg_from_rad(speed_rad_s));
    log.motor_Nm.push_back(output.motor_Nm);
    log.gear_Nm.push_back(output.gear_Nm);
    log.spring_Nm.push_back(output.spring_Nm);
    log.gear_load_Nm.push_back(output.gear_load_Nm);
    log.spring_load_Nm.push_back(output.spring_load_Nm);
    log.load_cell_Nm.push_back(cell.is_fresh(n) ? cell.values[n] : kNotMeasured);
  }
  return log;
}

double rmse(std::span<const double> values, std::span<const double> targets) {
  MetricsAccumulator errors;
  errors.add(values, targets);
  return errors.metrics().rmse;
}

/// Means over the repeats.
class JointMeans {
 public:
  JointMeans(std::size_t joint, double ratio, double torque_constant_Nm_A)
      : joint_(joint), ratio_(ratio), torque_constant_Nm_A_(torque_constant_Nm_A) {}

  /// @returns the coefficients
  MotorReferencedTorques::Parameters add(const Recording& training, const Recording& test,
                                         std::uint64_t seed) {
    const MotorReferencedFit fit =
        fit_motor_referenced_torques(training, torque_constant_Nm_A_, ratio_, {.seed = seed});
    for (std::size_t s = 0; s < kSources.size(); ++s) {
      const DeflectionTorqueFit& of = fit.*kSources[s].fit;
      for (std::size_t c = 0; c < kCoefficients.size(); ++c) {
        const Coefficient& coefficient = kCoefficients[c];
        values_[s][c].add(coefficient.scale * of.coefficients.*coefficient.value);
        errors_[s][c].add(coefficient.scale * of.standard_errors.*coefficient.value);
      }
      conditions_[s].add(of.condition_number);
      unscaled_[s].add(of.unscaled_condition_number);
      blocks_s_[s].add(of.block_s);
    }
    compare(log_of(test, fit.parameters), log_of(test, printed_parameters(joint_, fit.parameters)));
    return fit.parameters;
  }

  void write(std::vector<QuantityRow>& rows) const {
    for (std::size_t s = 0; s < kSources.size(); ++s)
      for (std::size_t c = 0; c < kCoefficients.size(); ++c)
        rows.push_back({.condition = std::string(kArm[joint_].joint),
                        .quantity = fmt::format("{} {}", kCoefficients[c].name, kSources[s].name),
                        .value = values_[s][c].mean(),
                        .unit = kCoefficients[c].unit,
                        .published = printed(joint_, s, c),
                        .remark = spread(s, c)});
    for (std::size_t s = 0; s < kSources.size(); ++s)
      add_row(rows, fmt::format("condition number of (16), {}", kSources[s].name),
              unscaled_[s].mean(), "-",
              fmt::format("columns of length 1: {:.3g}; blocks of {:.2g} s", conditions_[s].mean(),
                          blocks_s_[s].mean()));
    for (const auto& [name, mean] : rmse_Nm_) add_row(rows, name, mean.mean(), "Nm", {});
  }

 private:
  [[nodiscard]] std::string spread(std::size_t s, std::size_t c) const {
    std::string text = fmt::format("+- {:.2g} (bootstrap)", errors_[s][c].mean());
    if (values_[s][c].count() > 1)
      text += fmt::format(", {:.2g} between trajectories", values_[s][c].std_dev());
    return text;
  }
  void add_row(std::vector<QuantityRow>& rows, std::string quantity, double value, std::string unit,
               std::string remark) const {
    rows.push_back({.condition = std::string(kArm[joint_].joint),
                    .quantity = std::move(quantity),
                    .value = value,
                    .unit = std::move(unit),
                    .remark = std::move(remark)});
  }
  void compare(const JointLog& log, const JointLog& with_printed) {
    add_rmse("RMSE of (19) spring to motor current", rmse(log.spring_Nm, log.motor_Nm));
    add_rmse("RMSE of (18) gear to motor current", rmse(log.gear_Nm, log.motor_Nm));
    add_rmse("RMSE of (18) gear to (19) spring", rmse(log.gear_Nm, log.spring_Nm));
    add_rmse("RMSE of motor current to load cell", rmse(log.motor_Nm, log.load_cell_Nm));
    add_rmse("RMSE of (19) spring to load cell", rmse(log.spring_Nm, log.load_cell_Nm));
    add_rmse("RMSE of p0 + p1 dq spring to load cell", rmse(log.spring_load_Nm, log.load_cell_Nm));
    add_rmse("RMSE of (18) gear to load cell", rmse(log.gear_Nm, log.load_cell_Nm));
    add_rmse("RMSE of p0 + p1 dq gear to load cell", rmse(log.gear_load_Nm, log.load_cell_Nm));
    add_rmse("RMSE of (19) as printed to motor current",
             rmse(with_printed.spring_Nm, with_printed.motor_Nm));
    add_rmse("RMSE of (18) as printed to motor current",
             rmse(with_printed.gear_Nm, with_printed.motor_Nm));
  }
  void add_rmse(const std::string& name, double value) {
    const auto found = std::ranges::find(rmse_Nm_, name, &decltype(rmse_Nm_)::value_type::first);
    (found == rmse_Nm_.end() ? rmse_Nm_.emplace_back(name, RunningMean()) : *found)
        .second.add(value);
  }

  std::size_t joint_;
  double ratio_;
  double torque_constant_Nm_A_;
  std::array<std::array<RunningMean, kCoefficients.size()>, kSources.size()> values_, errors_;
  std::array<RunningMean, kSources.size()> conditions_, unscaled_, blocks_s_;
  std::vector<std::pair<std::string, RunningMean>> rmse_Nm_;
};

/// Means over `kShownBin_s`, up to `kShown_s`.
std::vector<double> shown(const std::vector<double>& values, double sample_rate_Hz) {
  const auto bin = static_cast<std::size_t>(kShownBin_s * sample_rate_Hz);
  const auto all = std::min(values.size(), static_cast<std::size_t>(kShown_s * sample_rate_Hz));
  std::vector<double> means;
  for (std::size_t n = 0; n + bin <= all; n += bin) {
    RunningMean mean;
    for (std::size_t k = 0; k < bin; ++k) mean.add(values[n + k]);
    means.push_back(mean.mean());
  }
  return means;
}

/// Figure 15: a row of a joint has position, speed and the three torques.
void draw(std::vector<ReportFigure>& figures, std::string_view joint, const JointLog& log,
          double sample_rate_Hz) {
  const auto t_s = shown(log.t_s, sample_rate_Hz);
  const auto plot = [&](const char* y, const std::string& title,
                        const std::vector<std::pair<const char*, const std::vector<double>*>>& of) {
    XyFigure figure{.title = title, .x = {"time [s]"}, .y = {y}, .series = {}};
    for (const auto& [label, all] : of)
      figure.series.push_back({.label = label, .x = t_s, .y = shown(*all, sample_rate_Hz)});
    figures.emplace_back(std::move(figure));
  };
  const std::string name(joint);
  plot("position [deg]", name, {{"", &log.angle_deg}});
  plot("speed [deg/s]", name, {{"", &log.speed_deg_s}});
  plot("torque [Nm]", name,
       {{"motor current (17)", &log.motor_Nm},
        {"gear deflection (18)", &log.gear_Nm},
        {"spring deflection (19)", &log.spring_Nm},
        {"spring, p0 + p1 dq: on the load", &log.spring_load_Nm}});
}

}  // namespace

/// Figure 13: the configurations of one trajectory, drawn as the arm in each of them.
void draw_configurations(std::vector<ReportFigure>& figures,
                         const std::vector<std::vector<double>>& configurations) {
  const std::size_t count = std::min(configurations.size(), kShownConfigurations);
  std::vector<std::string> labels;
  for (std::size_t k = 0; k < count; ++k) labels.push_back(fmt::format("configuration {}", k + 1));
  const std::vector<std::vector<double>> shown_rad(
      configurations.begin(), configurations.begin() + static_cast<std::ptrdiff_t>(count));
  for (ReportFigure& figure : arm_figures(arm6_setup().arm, shown_rad, labels))
    figures.push_back(std::move(figure));
}

Study arm_000(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "an arm of six elastic joints with a payload of 8 kg moves between random "
          "configurations, "
          "its joints at up to 25 deg/s, under its controller; masses and lengths of the arm are "
          "assumed. (16) is fitted to one trajectory per repeat; the RMSE are those of another",
      .unit = "Nm",
      .options = options};
  std::vector<JointMeans> means;
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    study.plants.push_back(study_plant(kArm[j].actuator));
    const DataSheet sheet = data_sheet(kArm[j].actuator);
    means.emplace_back(j, total_ratio(plant_parameters(sheet)),
                       sheet.motor.torque_constant_Nm_A.value);
  }
  const std::size_t segments = options.is_quick ? kQuickSegments : kSegments;
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    const auto training = record_arm(arm_configurations(segments, seed), seed,
                                     nth_of(progress, 2 * k, 2 * options.repeats, "fit"));
    const auto configurations = arm_configurations(segments, seed + kTest);
    const auto test = record_arm(configurations, seed + kTest,
                                 nth_of(progress, 2 * k + 1, 2 * options.repeats, "test"));
    for (std::size_t j = 0; j < kArmJoints; ++j) {
      const auto parameters = means[j].add(training[j], test[j], seed);
      if (k == 0)
        draw(study.figures, kArm[j].joint, log_of(test[j], parameters), test[j].sample_rate_Hz());
    }
  }
  draw_configurations(study.figures, arm_configurations(segments, repeat_seed(options, 0) + kTest));
  QuantityTable table;
  for (const JointMeans& of : means) of.write(table.rows);
  study.table = std::move(table);
  study.figure_columns = 3;
  study.notes.emplace_back(
      "k_t and k_r are those of Table 3. Its p0 contain the zeros of the encoders of that arm "
      "(p0/p1 "
      "of the gear: 0.170, -0.069, 0.082 deg); the encoders here have none, so that p0 cannot "
      "agree.");
  study.notes.emplace_back(
      "The Coulomb friction of the plants follows from the printed p3 of the spring, their gear "
      "stiffness (300 and 120 Nm) from the printed p1 of the gear; the viscous friction is "
      "assumed.");
  study.notes.emplace_back(
      "The poses of Figure 13 are not printed: those drawn here are the first configurations of "
      "the "
      "test trajectory, our own.");
  study.notes.emplace_back("Condition numbers are those of (16) in the paper's units.");
  return study;
}

}  // namespace torsio
