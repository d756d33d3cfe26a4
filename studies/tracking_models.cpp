#include "tracking_models.hpp"

#include <utility>
#include <vector>

#include "study_rows.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {

void add_torque_mode(Dataset& dataset, const TorqueModeSpec& of) {
  const bool is_locked = of.output == JointOutput::locked;
  for (const double share : {is_locked ? 1.1 : 0.9, 0.5, 0.25}) {
    ExperimentSpec spec{.actuator = of.actuator,
                        .experiment = std::string(name(of.kind)),
                        .seed = of.seed + 10 + dataset.records.size(),
                        .torque_amplitude_Nm = share * of.amplitude_Nm};
    if (!is_locked) spec.lever_m = TrackingSpec{}.lever_m;
    if (of.duration_s) spec.duration_s = of.duration_s;
    Recording recording = simulate(spec);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
}

AnyInverse learned_inverse(const LoopFamily& family, const Dataset& dataset, std::uint64_t seed) {
  ModelChoice choice{.family = std::string(family.name), .features = {}};
  if (family.is_swapped) {
    Dataset swapped = dataset;
    swap_input_and_target(swapped);
    choice.features = resolve_inputs(swapped, swapped.input_sets.front().second);
    return inverse_of(train_model(swapped, choice, seed).file);
  }
  const bool is_line = family.name == "linear";
  choice.features =
      resolve_inputs(dataset, is_line ? std::vector<std::string>{"spring_deflection_rad"}
                                      : std::vector<std::string>{});
  return inverse_of(train_model(dataset, choice, seed).file);
}

}  // namespace torsio
