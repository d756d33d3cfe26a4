#include "torsio/identify/calibrate_joints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "arm/vector3.hpp"
#include "numerics/centred_parabola.hpp"
#include "sim/arm/joint_channels.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/identification.hpp"

namespace torsio {
namespace {

constexpr std::array kBenchChannels{"motor_angle_rad", "gear_angle_rad", "joint_angle_rad",
                                    "motor_current_A"};
constexpr const char* kAngle = "joint_angle_rad";
constexpr double kShortest_s = 2.0;
constexpr double kTargetRate_Hz = 125.0;  // as the load cells of the benches

/// An arm that differs from the one of the setup by a standard deviation of one of its numbers.
struct VariedArm {
  ArmDynamics dynamics;
  bool is_weight;
};

std::vector<VariedArm> varied_arms(const ArmModel& arm, const CalibrationOptions& options) {
  std::vector<VariedArm> varied;
  const auto add = [&](bool is_weight, auto&& change) {
    ArmModel with = arm;
    change(with);
    varied.push_back({ArmDynamics(with), is_weight});
  };
  const auto scale = [](BodyInertia& body, double share) {
    body.mass_kg *= 1.0 + share;
    for (double& moment : body.inertia_kg_m2) moment *= 1.0 + share;
  };
  add(true, [&](ArmModel& with) { scale(with.payload, options.weight_share); });
  for (std::size_t i = 0; i < 3; ++i)
    add(true, [&](ArmModel& with) { with.payload.com_m[i] += options.attachment_m; });
  for (std::size_t k = 0; k < arm.joints.size(); ++k) {
    add(false, [&](ArmModel& with) { scale(with.joints[k].body, options.link_share); });
    for (std::size_t i = 0; i < 3; ++i)
      add(false, [&](ArmModel& with) { with.joints[k].body.com_m[i] += options.link_com_m; });
  }
  return varied;
}

ArmModel without_weight(ArmModel arm) {
  arm.payload = {};
  return arm;
}

/// The targets of one motion, joint by joint.
class TargetsOfMotion {
 public:
  TargetsOfMotion(const CalibrationMotion& motion, const CalibrationOptions& options)
      : motion_(motion),
        dynamics_(motion.setup.arm),
        unloaded_(without_weight(motion.setup.arm)),
        varied_(varied_arms(motion.setup.arm, options)),
        parabola_(
            static_cast<std::size_t>(std::max(
                2.0, std::round(0.5 * options.parabola_s * motion.recording.sample_rate_Hz()))),
            motion.recording.sample_rate_Hz()) {
    for (const ArmJoint& joint : motion.setup.arm.joints)
      angles_.push_back(&channel(joint.name, kAngle));
  }

  void add_to(std::vector<CalibratedJoint>& joints, std::vector<double>& weight_squares,
              std::vector<double>& links_squares, std::size_t& samples) {
    const std::size_t count = joints.size();
    const std::size_t all = motion_.recording.size();
    std::vector<std::vector<double>> target(count);
    for (std::size_t n = parabola_.half; n + parabola_.half < all; ++n) {
      ArmDynamics::PerJoint q = {};
      ArmDynamics::PerJoint v = {};
      ArmDynamics::PerJoint a = {};
      ArmDynamics::PerJoint torque_Nm = {};
      ArmDynamics::PerJoint other_Nm = {};
      for (std::size_t j = 0; j < count; ++j) {
        q[j] = (*angles_[j])[n];
        const auto [slope, curvature] = parabola_.at(*angles_[j], n);
        v[j] = slope;
        a[j] = curvature;
      }
      dynamics_.inverse(q, v, a, torque_Nm);
      for (std::size_t j = 0; j < count; ++j) target[j].push_back(torque_Nm[j]);
      if (n % kEvery != 0) continue;
      ++samples;
      unloaded_.gravity_torque(q, other_Nm);
      ArmDynamics::PerJoint weight_Nm = {};
      dynamics_.gravity_torque(q, weight_Nm);
      for (std::size_t j = 0; j < count; ++j) {
        joints[j].largest_Nm = std::max(joints[j].largest_Nm, std::abs(torque_Nm[j]));
        joints[j].largest_weight_Nm =
            std::max(joints[j].largest_weight_Nm, std::abs(weight_Nm[j] - other_Nm[j]));
      }
      for (const VariedArm& varied : varied_) {
        varied.dynamics.inverse(q, v, a, other_Nm);
        std::vector<double>& squares = varied.is_weight ? weight_squares : links_squares;
        for (std::size_t j = 0; j < count; ++j) {
          const double change_Nm = other_Nm[j] - torque_Nm[j];
          squares[j] += change_Nm * change_Nm;
        }
      }
    }
    for (std::size_t j = 0; j < count; ++j)
      joints[j].recordings.push_back(recording_of(joints[j].name, std::move(target[j])));
  }

 private:
  static constexpr std::size_t kEvery = 20;  // samples of which the uncertainty is computed

  [[nodiscard]] const std::vector<double>& channel(const std::string& joint,
                                                   const char* name) const {
    const Recording& recording = motion_.recording;
    const std::string full = joint_prefix(joint) + name;
    if (!recording.has(full))
      throw Error({.place = recording.name(),
                   .expected = fmt::format("a channel '{}'", full),
                   .found = "none of that name",
                   .advice = "Record with 'torsio arm -o', and give the YAML file of that arm."});
    const std::vector<double>& values = recording.channel(full).values;
    for (std::size_t n = 0; n < values.size(); ++n)
      if (!std::isfinite(values[n]))
        throw Error({.place = fmt::format("{}: {} at {:.3f} s", recording.name(), full,
                                          recording.time_s(n)),
                     .expected = "a finite value",
                     .found = fmt::format("{}", values[n]),
                     .advice = "Cut the recording there."});
    return values;
  }
  [[nodiscard]] Recording recording_of(const std::string& joint, std::vector<double> target) const {
    const Recording& from = motion_.recording;
    Recording own(fmt::format("{} {}", from.name(), joint), from.sample_rate_Hz());
    const auto half = static_cast<std::ptrdiff_t>(parabola_.half);
    for (const char* name : kBenchChannels) {
      const std::vector<double>& values = channel(joint, name);
      own.add({.name = name, .values = {values.begin() + half, values.end() - half}});
    }
    // Its parabola has no information that faster samples would add: they only make a fit longer.
    std::vector<std::uint8_t> fresh(target.size(), 0);
    const auto step =
        static_cast<std::size_t>(std::max(1.0, std::round(from.sample_rate_Hz() / kTargetRate_Hz)));
    for (std::size_t n = 0; n < fresh.size(); n += step) fresh[n] = 1;
    own.add({.name = "torque_Nm", .values = std::move(target), .fresh = std::move(fresh)});
    return own;
  }

  const CalibrationMotion& motion_;
  ArmDynamics dynamics_;
  ArmDynamics unloaded_;
  std::vector<VariedArm> varied_;
  CentredParabola parabola_;
  std::vector<const std::vector<double>*> angles_;
};

void require_same_arm(const ArmSetup& first, const CalibrationMotion& motion) {
  const auto names = [](const ArmSetup& setup) {
    std::string text;
    for (std::size_t j = 0; j < setup.joints.size(); ++j)
      text += (text.empty() ? "" : ", ") + setup.arm.joints[j].name + " " +
              full_name(setup.joints[j].sheet);
    return text;
  };
  if (names(motion.setup) == names(first)) return;
  throw Error({.place = motion.recording.name(),
               .problem = "the recordings are of different arms",
               .expected = names(first),
               .found = names(motion.setup)});
}

void require_usable(const CalibrationMotion& motion) {
  const double duration_s =
      static_cast<double>(motion.recording.size()) / motion.recording.sample_rate_Hz();
  if (!(motion.setup.arm.payload.mass_kg > 0.0))
    throw Error({.place = motion.recording.name(),
                 .problem = "there is no known weight",
                 .expected = "an arm whose payload is the weight of the calibration",
                 .found = "a payload of 0 kg",
                 .advice = "Weigh it to 0.1 %, and give the arm's file with that payload."});
  if (duration_s < kShortest_s)
    throw Error({.place = motion.recording.name(),
                 .problem = "the recording is too short",
                 .expected = "at least 2 s",
                 .found = fmt::format("{:.3g} s", duration_s)});
  require_carriable(motion.setup, motion.recording.name());
  ArmMotion moved{.name = motion.recording.name(),
                  .sample_rate_Hz = motion.recording.sample_rate_Hz()};
  for (const ArmJoint& joint : motion.setup.arm.joints) {
    const std::string name = joint_prefix(joint.name) + kAngle;
    if (!motion.recording.has(name)) return;  // refused with what to do
    moved.angle_rad.push_back(motion.recording.channel(name).values);
  }
  moved.torque_Nm = moved.angle_rad;
  require_motion(moved, motion.setup.arm);
}

void require_possible(const CalibrationOptions& options) {
  const auto check = [](double value, const char* place, double largest) {
    if (!(value >= 0.0 && value <= largest))
      throw UsageError({.place = place,
                        .expected = fmt::format("0 to {:g}", largest),
                        .found = fmt::format("{:g}", value)});
  };
  check(options.weight_share, "weight_share", 0.1);
  check(options.attachment_m, "attachment_m", 0.1);
  check(options.link_share, "link_share", 0.5);
  check(options.link_com_m, "link_com_m", 0.1);
  check(options.parabola_s, "parabola_s", 0.5);
  check(options.least_share, "least_share", 1.0);
}

}  // namespace

std::vector<CalibratedJoint> calibrate_joints(std::span<const CalibrationMotion> motions,
                                              const CalibrationOptions& options) {
  require_possible(options);
  if (motions.empty())
    throw UsageError({.place = "calibrate_joints", .expected = "a recording", .found = "none"});
  const ArmSetup& first = motions.front().setup;
  std::vector<CalibratedJoint> joints;
  joints.reserve(first.joints.size());
  for (std::size_t j = 0; j < first.joints.size(); ++j)
    joints.push_back({.name = first.arm.joints[j].name,
                      .actuator = full_name(first.joints[j].sheet),
                      .rating_Nm = first.joints[j].sheet.rating.torque_Nm.value});
  std::vector<double> weight_squares(joints.size(), 0.0);
  std::vector<double> links_squares(joints.size(), 0.0);
  std::size_t samples = 0;
  for (const CalibrationMotion& motion : motions) {
    require_same_arm(first, motion);
    require_usable(motion);
    TargetsOfMotion(motion, options).add_to(joints, weight_squares, links_squares, samples);
  }
  const auto count = static_cast<double>(std::max<std::size_t>(samples, 1));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    CalibratedJoint& joint = joints[j];
    joint.weight_std_Nm = std::sqrt(weight_squares[j] / count);
    joint.links_std_Nm = std::sqrt(links_squares[j] / count);
    joint.target_std_Nm = std::hypot(joint.weight_std_Nm, joint.links_std_Nm);
    joint.is_determined = joint.weight_share() >= options.least_share;
    if (!joint.is_determined)
      joint.reason = fmt::format(
          "the weight causes at most {:.2g} Nm, {:.0f} % of the rating (at least {:g} %)",
          joint.largest_weight_Nm, 100.0 * joint.weight_share(), 100.0 * options.least_share);
  }
  return joints;
}

}  // namespace torsio
