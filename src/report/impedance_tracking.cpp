#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
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

std::string_view name(Kind kind) {
  if (kind == Kind::wanted) return "wanted";
  return kind == Kind::high ? "high" : "zero";
}

std::string angle_text(Complex of) {
  return std::abs(of) == 0.0 ? std::string("-") : fmt::format("{:.0f}", deg_from_rad(std::arg(of)));
}

std::string size_text(Complex of) { return fmt::format("{:.4g}", std::abs(of)); }

std::string task(const ImpedanceRun& run) {
  if (run.spec.kind == Kind::wanted)
    return fmt::format("impedance of {:g} Nm/rad and {:g} Nms/rad", run.spec.stiffness_Nm_rad,
                       run.spec.damping_Nms_rad);
  return fmt::format("{} impedance of paper 004", name(run.spec.kind));
}

std::string passivity_text(const ImpedanceRun& run) {
  const std::string range =
      run.passive_to_Hz > 0.0 ? fmt::format("passive up to {:.4g} Hz", run.passive_to_Hz)
                              : std::string("unstable: the dry friction of the gear stabilises it");
  const std::string limit =
      run.largest_passive_Nm_rad > 0.0
          ? fmt::format("at most {:.4g} Nm/rad are", run.largest_passive_Nm_rad)
          : std::string("no stiffness is");
  return fmt::format(
      "without dry friction {};\nwith this damping and torque gain {} passive up to {:g} Hz\n",
      range, limit, ImpedanceRun::kPassiveTo_Hz);
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
      of.hand_range_deg, HandForces::kFrequency_Hz, run.spec.duration_s,
      HandForces::kArmStiffness_Nm_rad, HandForces::kArmDamping_Nms_rad, of.joint_range_deg,
      of.rms_Nm, of.max_Nm, HandForces::kLever_m, of.rms_N, of.max_N, of.mean_power_W,
      of.rms_to_wanted_Nm);
}

Json impedance_of(Complex of, double frequency_Hz) {
  return {{"magnitude_Nm_rad", std::abs(of)},
          {"phase_deg", std::abs(of) == 0.0 ? Json(nullptr) : Json(deg_from_rad(std::arg(of)))},
          {"magnitude_Nms_rad", std::abs(of) / (2.0 * std::numbers::pi * frequency_Hz)}};
}

Json hand_json(const HandForces& of) {
  return {{"arm_stiffness_Nm_rad", HandForces::kArmStiffness_Nm_rad},
          {"arm_damping_Nms_rad", HandForces::kArmDamping_Nms_rad},
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

}  // namespace

std::string impedance_text(const ImpedanceRun& run) {
  TextTable table;
  table.header({"Hz", "wanted Nm/rad", "deg", "linear model", "deg", "rendered", "deg",
                "rendered / linear"});
  for (const ImpedancePoint& point : run.points)
    table.row({fmt::format("{:g}", point.frequency_Hz), size_text(point.wanted_Nm_rad),
               angle_text(point.wanted_Nm_rad), size_text(point.linear_Nm_rad),
               angle_text(point.linear_Nm_rad), size_text(point.rendered_Nm_rad),
               angle_text(point.rendered_Nm_rad),
               fmt::format("{:.3f}", std::abs(point.rendered_Nm_rad / point.linear_Nm_rad))});
  return fmt::format(
      "{} ({}), {}, seed {}\n"
      "gains K_pp {:.4g}, K_dp {:.4g} s, K_tp {:.4g} Nm/rad; at rest {:.4g} Nm/rad\n{}"
      "torque over angle at the output, sines of {:g} Nm; linear model: without dry friction, with "
      "the inertia of the joint\n{}"
      "cycles with limited current: {:.3g} %\n{}",
      run.actuator, run.variant, task(run), run.seed, run.gains.position, run.gains.damping_s,
      run.gains.torque_Nm_rad, run.stiffness_Nm_rad, passivity_text(run), run.spec.amplitude_Nm,
      table.text(), 100.0 * run.limited_share, hand_text(run));
}

std::string impedance_json(const ImpedanceRun& run) {
  Json points = Json::array();
  for (const ImpedancePoint& point : run.points)
    points.push_back({{"frequency_Hz", point.frequency_Hz},
                      {"wanted", impedance_of(point.wanted_Nm_rad, point.frequency_Hz)},
                      {"linear", impedance_of(point.linear_Nm_rad, point.frequency_Hz)},
                      {"rendered", impedance_of(point.rendered_Nm_rad, point.frequency_Hz)}});
  return json_text(Json{{"actuator", run.actuator},
                        {"variant", run.variant},
                        {"impedance", name(run.spec.kind)},
                        {"stiffness_Nm_rad", run.stiffness_Nm_rad},
                        {"damping_Nms_rad", run.damping_Nms_rad},
                        {"gains",
                         {{"position", run.gains.position},
                          {"damping_s", run.gains.damping_s},
                          {"torque_Nm_rad", run.gains.torque_Nm_rad}}},
                        {"passive_to_Hz", run.passive_to_Hz},
                        {"largest_passive_stiffness_Nm_rad", run.largest_passive_Nm_rad},
                        {"amplitude_Nm", run.spec.amplitude_Nm},
                        {"duration_s", run.spec.duration_s},
                        {"seed", run.seed},
                        {"limited_share", run.limited_share},
                        {"frequencies", std::move(points)},
                        {"hand", hand_json(run.hand)}});
}

}  // namespace torsio
