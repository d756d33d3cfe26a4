#pragma once

#include <string>

#include "model/hysteresis/operator_sum.hpp"
#include "support/every_family.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "support/grey_box_examples.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {

/// A linear model whose coefficients depend on its second input.
struct Scheduled : Linear {
  using Linear::Linear;
};
template <>
inline Scheduled example<Scheduled>() {
  Linear::Parameters parameters;
  parameters.coefficients = {
      .scheduled = true, .feature = 1, .knots = {-1.0, 0.0, 2.0}, .values = Matrix(3, 3)};
  parameters.coefficients.values.values = {0.5, 80.0, 1.0, 0.1, 100.0, 2.0, -0.5, 90.0, 4.0};
  return Scheduled(parameters);
}

/// Guards that detect jumps; the ranges lie within the reach of the motion.
inline ModelFile guarded(const AnyModel& model) {
  ModelFile file = example_model_file(model);
  file.settings.ranges = {.lowest = {-0.1, -3.0}, .highest = {0.1, 3.0}, .margin = 0.05};
  file.settings.disturbances = {
      .largest_step = {0.01, 0.01}, .largest_travel = 0.01, .warm_up_s = 0.05};
  file.settings.output.largest_target = 400.0;
  file.settings.target_uncertainty = {.constant = 0.3, .relative = 0.05};
  file.settings.strokes = {.longest_s = 0.05, .dead_band = 0.004, .growth = 0.5, .limit = 30.0};
  return file;
}

/// The same with every operation that has a memory, and others.
inline ModelFile remembering(const AnyModel& model) {
  ModelFile file = guarded(model);
  file.settings.features.inputs = {
      "stop(spring_deflection_rad, 60mrad) + 0.1 * dahl(spring_deflection_rad, 20mrad)",
      "lowpass(rate(lag(spring_deflection_rad, 3)), 50Hz) + sin(joint_angle_rad) * "
      "exp(-abs(joint_angle_rad)) + "
      "min(gear_angle_rad, 0) ^ 2 + sqrt(abs(gear_angle_rad)) + atan(joint_angle_rad) + "
      "tanh(gear_angle_rad)"};
  return file;
}

template <class Family>
AnyModel any_example() {
  return AnyModel(AnyModel::Parameters(example<Family>().parameters()));
}

using Exported =
    testing::Types<Linear, Scheduled, GreyBoxWithBanks, GreyBoxWithMlp, GreyBoxWithProducts,
                   GreyBoxWithGp, LinearCoulomb, Polynomial, MaxwellSlipModel, PrandtlIshlinskii,
                   GreyBox, Mlp, Gru, Lstm, ParametricGp, Viscoelastic, HammersteinWiener>;
struct ExportedName {
  template <class M>
  static std::string GetName(int index) {
    return std::to_string(index) + "_" + std::string(M::kFamily);
  }
};

}  // namespace torsio::test
