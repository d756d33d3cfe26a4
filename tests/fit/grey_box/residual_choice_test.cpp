#include "fit/grey_box/residual_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <utility>

#include "fit/common/model_run.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Pushes of a person on a harmonic drive, whose friction depends on load and speed.
TrainingData pushes_of(std::initializer_list<double> torques_Nm, std::uint64_t seed) {
  Dataset dataset;
  for (const double torque_Nm : torques_Nm) {
    Recording recording = simulate({.actuator = "harmonic-drive:stiff",
                                    .experiment = "human-torque",
                                    .seed = seed + dataset.records.size(),
                                    .duration_s = 80.0,
                                    .torque_amplitude_Nm = torque_Nm});
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
  return training_data(
      dataset,
      resolve_inputs(dataset, {"motor_angle_rad / 2 - wave_generator_angle_rad", "motor_torque_Nm",
                               "lowpass(rate(wave_generator_angle_rad), 10Hz)"}));
}

TEST(ResidualChoice, IsTheNetworkWhereItPredictsRecordingsBest) {
  const TrainingData data = pushes_of({14.0, 16.0, 18.0, 20.0}, 1);
  const TrainingData others = pushes_of({17.0}, 41);
  const Fitted<GreyBox> chosen = fit_grey_box(data, {});
  EXPECT_THAT(chosen.notes.back(), AllOf(HasSubstr("a network for the residual was added"),
                                         HasSubstr("on held-out recordings")));
  const Fitted<GreyBox> products = fit_grey_box(data, {.residual = ResidualKind::products});
  EXPECT_LT(evaluate(GreyBox(chosen.parameters), others).rmse,
            0.95 * evaluate(GreyBox(products.parameters), others).rmse);
}

}  // namespace
}  // namespace torsio
