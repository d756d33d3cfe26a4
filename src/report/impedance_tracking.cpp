#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <string_view>

#include "report/json_text.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/report/tracking.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;
using Json = nlohmann::ordered_json;
using Kind = ImpedanceSpec::Kind;

constexpr double kTurn = 2.0 * std::numbers::pi;

std::string_view name(Kind kind) {
  if (kind == Kind::wanted) return "wanted";
  return kind == Kind::high ? "high" : "zero";
}

std::string angle_text(Complex of) {
  return std::abs(of) == 0.0 ? std::string("-") : fmt::format("{:.0f}", deg_from_rad(std::arg(of)));
}

std::string size_text(Complex of) { return fmt::format("{:.4g}", std::abs(of)); }

std::string task(const ImpedanceRun& run) {
  if (run.spec.kind == Kind::wanted || !run.tube)
    return fmt::format("impedance of {:g} Nm/rad and {:g} Nms/rad", run.stiffness_Nm_rad,
                       run.damping_Nms_rad);
  return fmt::format("{} impedance of paper 004", name(run.spec.kind));
}

/// The gains of `high` rely on the dry friction, which the linear model that checks the others does not have.
std::string unchecked_text(const ImpedanceRun& run) {
  if (run.spec.kind != Kind::high || !run.correction_rad_s) return {};
  return "whether the correction by the estimate is stable is not checked: the linear model of the "
         "check has no "
         "dry friction;\n";
}

std::string passivity_text(const ImpedanceRun& run) {
  const std::string range =
      run.passive_to_Hz > 0.0 ? fmt::format("passive up to {:.4g} Hz", run.passive_to_Hz)
                              : std::string(run.tube ? "unstable: the dry friction of the gear "
                                                       "stabilises it"
                                                     : "stable, but not passive at any frequency");
  const std::string limit =
      run.largest_passive_Nm_rad > 0.0
          ? fmt::format("at most {:.4g} Nm/rad are", run.largest_passive_Nm_rad)
          : std::string("no stiffness is");
  return fmt::format(
      "without dry friction {};\n{}with this damping and these gains {} passive up to {:g} Hz\n",
      range, unchecked_text(run), limit, run.passive_goal_Hz);
}

std::string gains_text(const ImpedanceRun& run) {
  if (run.tube)
    return fmt::format("gains K_pp {:.4g}, K_dp {:.4g} s, K_tp {:.4g} Nm/rad", run.tube->position,
                       run.tube->damping_s, run.tube->torque_Nm_rad);
  return fmt::format("torque loop of {:.3g} Hz through the spring", *run.bandwidth_rad_s / kTurn);
}

std::string model_text(const ImpedanceRun& run) {
  if (run.model.empty()) return {};
  if (!run.correction_rad_s) return fmt::format("inverse of the spring: {}\n", run.model);
  return fmt::format("the estimate of {} corrects the torque below {:.3g} Hz, since {}\n",
                     run.model, *run.correction_rad_s / kTurn, run.model_reason);
}

std::string hand_text(const ImpedanceRun& run) {
  const HandForces& of = run.hand;
  return fmt::format(
      "a hand that moves {:.3g} deg at {:g} Hz for {:g} s, its arm with {:g} Nm/rad and {:g} "
      "Nms/rad:\n"
      "the joint moves {:.3g} deg; torque {:.3g} Nm RMS, {:.3g} Nm at most; force at {:g} m {:.3g} "
      "N "
      "RMS, {:.3g} N at most;\n"
      "mean power into the joint {:.3g} W; torque less that of the wanted impedance {:.3g} Nm "
      "RMS\n",
      of.hand_range_deg, HandForces::kFrequency_Hz, run.spec.duration_s, of.arm_stiffness_Nm_rad,
      of.arm_damping_Nms_rad, of.joint_range_deg, of.rms_Nm, of.max_Nm, HandForces::kLever_m,
      of.rms_N, of.max_N, of.mean_power_W, of.rms_to_wanted_Nm);
}

Json impedance_of(Complex of, double frequency_Hz) {
  return {{"magnitude_Nm_rad", std::abs(of)},
          {"phase_deg", std::abs(of) == 0.0 ? Json(nullptr) : Json(deg_from_rad(std::arg(of)))},
          {"magnitude_Nms_rad", std::abs(of) / (kTurn * frequency_Hz)}};
}

Json gains_json(const ImpedanceRun& run) {
  if (run.tube)
    return {{"position", run.tube->position},
            {"damping_s", run.tube->damping_s},
            {"torque_Nm_rad", run.tube->torque_Nm_rad}};
  return {{"bandwidth_rad_s", *run.bandwidth_rad_s},
          {"proportional_A_rad", run.deflection->proportional},
          {"integral_A_rad_s", run.deflection->integral},
          {"derivative_As_rad", run.deflection->derivative}};
}

Json hand_json(const HandForces& of) {
  return {{"arm_stiffness_Nm_rad", of.arm_stiffness_Nm_rad},
          {"arm_damping_Nms_rad", of.arm_damping_Nms_rad},
          {"frequency_Hz", HandForces::kFrequency_Hz},
          {"lever_m", HandForces::kLever_m},
          {"hand_range_deg", of.hand_range_deg},
          {"joint_range_deg", of.joint_range_deg},
          {"torque_rms_Nm", of.rms_Nm},
          {"torque_max_Nm", of.max_Nm},
          {"force_rms_N", of.rms_N},
          {"force_max_N", of.max_N},
          {"mean_power_W", of.mean_power_W},
          {"torque_less_wanted_rms_Nm", of.rms_to_wanted_Nm}};
}

Json document(const ImpedanceRun& run) {
  Json points = Json::array();
  for (const ImpedancePoint& point : run.points)
    points.push_back({{"frequency_Hz", point.frequency_Hz},
                      {"wanted", impedance_of(point.wanted_Nm_rad, point.frequency_Hz)},
                      {"linear", impedance_of(point.linear_Nm_rad, point.frequency_Hz)},
                      {"rendered", impedance_of(point.rendered_Nm_rad, point.frequency_Hz)}});
  return {{"actuator", run.actuator},
          {"variant", run.variant},
          {"impedance", name(run.spec.kind)},
          {"stiffness_Nm_rad", run.stiffness_Nm_rad},
          {"damping_Nms_rad", run.damping_Nms_rad},
          {"model", run.model.empty() ? Json(nullptr) : Json(run.model)},
          {"model_reason", run.model_reason.empty() ? Json(nullptr) : Json(run.model_reason)},
          {"correction_rad_s", run.correction_rad_s ? Json(*run.correction_rad_s) : Json(nullptr)},
          {"gains", gains_json(run)},
          {"passive_to_Hz", run.passive_to_Hz},
          {"passive_goal_Hz", run.passive_goal_Hz},
          {"largest_passive_stiffness_Nm_rad", run.largest_passive_Nm_rad},
          {"amplitude_Nm", run.amplitude_Nm},
          {"duration_s", run.spec.duration_s},
          {"seed", run.seed},
          {"limited_share", run.limited_share},
          {"frequencies", std::move(points)},
          {"hand", hand_json(run.hand)}};
}

/// Where the wanted impedance and the inertia of the joint nearly cancel in the linear model.
bool is_antiresonance(const ImpedancePoint& point) {
  constexpr double kLeft = 0.5;
  return std::abs(point.linear_Nm_rad) < kLeft * std::abs(point.wanted_Nm_rad);
}

/// |rendered - wanted| over |wanted|, the mean of the frequencies up to 1 Hz.
double error_of(const ImpedanceRun& run) {
  double sum = 0.0;
  double count = 0.0;
  for (const ImpedancePoint& point : run.points) {
    if (point.frequency_Hz > 1.0) break;
    sum += std::abs(point.rendered_Nm_rad - point.wanted_Nm_rad) / std::abs(point.wanted_Nm_rad);
    count += 1.0;
  }
  return sum / count;
}

std::string summary(std::span<const ImpedanceRun> runs) {
  TextTable table;
  table.header({"model", "used as", "0.1 Hz Nm/rad", "1 Hz Nm/rad", "error up to 1 Hz",
                "hand: less wanted Nm RMS"});
  const auto size_at = [](const ImpedanceRun& run, double frequency_Hz) {
    const auto found = std::ranges::find(run.points, frequency_Hz, &ImpedancePoint::frequency_Hz);
    return size_text(found->rendered_Nm_rad);
  };
  for (const ImpedanceRun& run : runs) {
    const bool has_wanted = std::abs(run.points.front().wanted_Nm_rad) > 0.0;
    table.row({run.model.empty() ? "none" : run.model,
               run.model.empty()      ? "-"
               : run.correction_rad_s ? "correction"
                                      : "inverse",
               size_at(run, 0.1), size_at(run, 1.0),
               has_wanted ? fmt::format("{:.1f} %", 100.0 * error_of(run)) : "-",
               fmt::format("{:.3g}", run.hand.rms_to_wanted_Nm)});
  }
  return table.text();
}

}  // namespace

std::string impedance_text(const ImpedanceRun& run) {
  TextTable table;
  table.header({"Hz", "wanted Nm/rad", "deg", "linear model", "deg", "rendered", "deg",
                "rendered / linear"});
  bool has_antiresonance = false;
  for (const ImpedancePoint& point : run.points) {
    has_antiresonance |= is_antiresonance(point);
    table.row({fmt::format("{:g}", point.frequency_Hz), size_text(point.wanted_Nm_rad),
               angle_text(point.wanted_Nm_rad), size_text(point.linear_Nm_rad),
               angle_text(point.linear_Nm_rad), size_text(point.rendered_Nm_rad),
               angle_text(point.rendered_Nm_rad),
               is_antiresonance(point)
                   ? "-"
                   : fmt::format("{:.3f}", std::abs(point.rendered_Nm_rad / point.linear_Nm_rad))});
  }
  return fmt::format(
      "{} ({}), {}, seed {}\n"
      "{}{}; at rest {:.4g} Nm/rad\n{}"
      "torque over angle at the output, sines of {:g} Nm; linear model: without dry friction, with "
      "the inertia of the joint\n{}{}"
      "cycles with limited current: {:.3g} %\n{}",
      run.actuator, run.variant, task(run), run.seed, model_text(run), gains_text(run),
      run.stiffness_Nm_rad, passivity_text(run), run.amplitude_Nm, table.text(),
      has_antiresonance ? "-: an antiresonance, at which the linear model is near 0 and the dry "
                          "friction is all that is left: no ratio\n"
                        : "",
      100.0 * run.limited_share, hand_text(run));
}

std::string impedance_text(std::span<const ImpedanceRun> runs) {
  std::string text;
  for (const ImpedanceRun& run : runs) text += impedance_text(run) + "\n";
  if (runs.size() < 2) return text.substr(0, text.size() - 1);
  return text + summary(runs);
}

std::string impedance_json(const ImpedanceRun& run) { return json_text(document(run)); }

std::string impedance_json(std::span<const ImpedanceRun> runs) {
  if (runs.size() == 1) return impedance_json(runs.front());
  Json all = Json::array();
  for (const ImpedanceRun& run : runs) all.push_back(document(run));
  return json_text(Json{{"runs", std::move(all)}});
}

}  // namespace torsio
