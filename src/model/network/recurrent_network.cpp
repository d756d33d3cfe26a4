#include "model/network/recurrent_network.hpp"

#include <string>

#include "model/network/network_checks.hpp"

namespace torsio {

template <class Layer>
RecurrentNetwork<Layer>::RecurrentNetwork(const RecurrentParameters<Layer>& parameters,
                                          std::size_t joints, std::string_view family)
    : scaling_(parameters.scaling),
      stack_(parameters.layers,
             checked_input_count(parameters.scaling, std::string(family) + ": scaling"), joints,
             std::string(family) + ": layers"),
      head_(parameters.head, stack_.output_count(), std::string(family) + ": head"),
      warm_up_samples_(parameters.warm_up_samples),
      inputs_(joints * input_count(), 0.0F),
      steps_(joints, 0) {
  check_positive(parameters.sample_period_s, std::string(family) + ": sample_period_s");
}

template <class Layer>
void RecurrentNetwork<Layer>::reset() noexcept {
  for (std::size_t joint = 0; joint < joint_count(); ++joint) reset(joint);
}

template <class Layer>
void RecurrentNetwork<Layer>::reset(std::size_t joint) noexcept {
  stack_.reset(joint);
  steps_[joint] = 0;
}

template <class Layer>
void RecurrentNetwork<Layer>::set_state(std::size_t joint, std::span<const float> state) noexcept {
  stack_.set_state(joint, state);
  steps_[joint] = warm_up_samples_;
}

template <class Layer>
void RecurrentNetwork<Layer>::step(std::span<const double> features,
                                   std::span<Estimate> estimates) noexcept {
  const std::size_t inputs = input_count();
  for (std::size_t joint = 0; joint < joint_count(); ++joint)
    standardise(scaling_, features.subspan(joint * inputs, inputs),
                inputs_.data() + joint * inputs);
  stack_.step(inputs_.data());
  for (std::size_t joint = 0; joint < joint_count(); ++joint) {
    const bool is_warm = steps_[joint] >= warm_up_samples_;
    if (!is_warm) ++steps_[joint];
    estimates[joint] = {.value = destandardise(scaling_, head_.evaluate(stack_.output(joint))),
                        .fault = is_warm ? Fault::none : Fault::warming_up};
  }
}

template class RecurrentNetwork<LstmLayer>;
template class RecurrentNetwork<GruLayer>;

}  // namespace torsio
