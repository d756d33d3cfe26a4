#include "torsio/estimate/joint_sample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

struct JointChannel {
  std::string_view name;
  double (*get)(const JointSample&) noexcept;
};

constexpr auto kJointChannels = std::to_array<JointChannel>({
    {"t_s", [](const JointSample& sample) noexcept { return sample.t_s; }},
    {"motor_angle_rad", [](const JointSample& sample) noexcept { return sample.motor_angle_rad; }},
    {"gear_angle_rad", [](const JointSample& sample) noexcept { return sample.gear_angle_rad; }},
    {"joint_angle_rad", [](const JointSample& sample) noexcept { return sample.joint_angle_rad; }},
    {"motor_current_A", [](const JointSample& sample) noexcept { return sample.motor_current_A; }},
    {"spring_deflection_rad",
     [](const JointSample& sample) noexcept { return sample.spring_deflection_rad(); }},
});

std::string known_names() {
  std::string list;
  for (const JointChannel& channel : kJointChannels) {
    if (!list.empty()) list += ", ";
    list += channel.name;
  }
  return list;
}

}  // namespace

detail::JointInputs::JointInputs(const std::vector<std::string>& raw_inputs,
                                 const std::string& target)
    : raw_(raw_inputs.size()) {
  if (const auto parts = split_channel_name(target); !parts || parts->unit->si_suffix != "Nm")
    throw Error({.place = "torque estimator",
                 .expected = "a model whose target is a torque in Nm",
                 .found = fmt::format("the target '{}'", target),
                 .advice = "Use an Estimator, which estimates any target."});
  for (const std::string& name : raw_inputs) {
    const auto* const channel = std::ranges::find(kJointChannels, name, &JointChannel::name);
    if (channel == kJointChannels.end())
      throw Error({.place = fmt::format("torque estimator: raw input {}", name),
                   .expected = fmt::format("one of {}", known_names()),
                   .found = "a channel that a JointSample does not have",
                   .advice = "Use an Estimator and pass it the raw channels."});
    getters_.push_back(channel->get);
  }
}

std::span<const double> detail::JointInputs::from(const JointSample& sample) noexcept {
  std::ranges::transform(getters_, raw_.begin(), [&](Getter get) { return get(sample); });
  return raw_;
}

}  // namespace torsio
