#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// The properties in which joints of one type are compared. Each is a kind of fault of production. Stores have the
/// numbers: new ones are added at the end.
enum class JointTrait : std::uint8_t {
  stiffness,  ///< relative to the base model; a gain of the load cell looks the same
  friction,  ///< work until the friction of the spring slides, relative to the base model: torque times angle
  zero,           ///< offset of the torque at the same deflection
  backlash,       ///< additional half play
  encoder_error,  ///< amplitude of an error that repeats with an angle
  loose_sensor,   ///< wander of the zero from one change of the load's sign to the next
  noise,          ///< what none of these explains
  asymmetry,  ///< half of the difference of the stiffness between both signs of the load, relative
};

inline constexpr std::size_t kJointTraits = 8;
/// In the order of tables.
inline constexpr std::array<JointTrait, kJointTraits> kAllJointTraits{
    JointTrait::stiffness, JointTrait::asymmetry,     JointTrait::friction,     JointTrait::zero,
    JointTrait::backlash,  JointTrait::encoder_error, JointTrait::loose_sensor, JointTrait::noise};

/// "stiffness", "asymmetry", "friction", "zero", "backlash", "encoder error", "loose sensor", "noise"
[[nodiscard]] std::string_view name(JointTrait trait) noexcept;

/// Whether it is an amplitude: only large ones are faults.
[[nodiscard]] constexpr bool is_size(JointTrait trait) noexcept {
  return trait == JointTrait::encoder_error || trait == JointTrait::loose_sensor ||
         trait == JointTrait::noise;
}

/// The form in which joints are compared: sizes by their logarithm, the friction by that of its factor.
[[nodiscard]] inline double compared(JointTrait trait, double value) {
  if (is_size(trait)) return std::log(value);
  return trait == JointTrait::friction ? std::log1p(value) : value;
}
/// The inverse: the value of a limit or median of a test.
[[nodiscard]] inline double natural(JointTrait trait, double value) {
  if (is_size(trait)) return std::exp(value);
  return trait == JointTrait::friction ? std::expm1(value) : value;
}

/// The traits of one joint against the model of its family.
struct JointTraits {
  struct Value {
    double value = kNotMeasured;      ///< relative traits: 0.08 for 8 %; else in `unit`
    double std_error = kNotMeasured;  ///< NaN: not known
    std::string unit = {};            ///< empty: relative
  };
  std::array<Value, kJointTraits> values = {};
  std::string encoder = {};         ///< angle with which the encoder error repeats
  std::size_t encoder_periods = 0;  ///< per turn
  double rmse = kNotMeasured;       ///< error of the base model on the joint, in the target's unit

  [[nodiscard]] Value& operator[](JointTrait trait) noexcept {
    return values.at(static_cast<std::size_t>(trait));
  }
  [[nodiscard]] const Value& operator[](JointTrait trait) const noexcept {
    return values.at(static_cast<std::size_t>(trait));
  }
};

}  // namespace torsio
