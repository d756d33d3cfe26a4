#include "torsio/model/adaptive_model.hpp"

#include <string>

#include "torsio/core/dispatch.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

static_assert(Model<AdaptiveModel>);

/// The dense layers of a network, or null.
template <class Parameters>
auto* dense_layers(Parameters& parameters) {
  if constexpr (requires { parameters.head; }) {
    return &parameters.head;
  } else if constexpr (requires { parameters.layers; }) {
    return &parameters.layers;
  } else {
    return static_cast<const std::vector<DenseLayer>*>(nullptr);
  }
}

LastLayerAdapter adapter_of(const AdaptiveModel::Parameters& parameters) {
  const double target_scale = dispatch(parameters.network, [](const auto& own) {
    if constexpr (requires { own.scaling.target_scale; })
      return own.scaling.target_scale;
    else
      return 1.0;
  });
  return {parameters.adaptation, require_last_layer(parameters.network), target_scale,
          parameters.sample_period_s};
}

}  // namespace

const DenseLayer* last_layer(const AnyModel::Parameters& parameters) noexcept {
  return dispatch(parameters, [](const auto& own) -> const DenseLayer* {
    const auto* const layers = dense_layers(own);
    return layers == nullptr || layers->empty() ? nullptr : &layers->back();
  });
}

const DenseLayer& require_last_layer(const AnyModel::Parameters& parameters) {
  if (const DenseLayer* const last = last_layer(parameters)) return *last;
  throw UsageError({.place = "adaptation",
                    .expected = "a network: mlp, lstm or gru",
                    .found = std::string(family_of(parameters)),
                    .advice = "Only a single network has a last layer to adapt: fit one, without "
                              "members. Other families are fitted again."});
}

AdaptiveModel::AdaptiveModel(const Parameters& parameters)
    : network_(parameters.network),
      adapter_(adapter_of(parameters)),
      sample_period_s_(parameters.sample_period_s) {}

AdaptiveModel::Parameters AdaptiveModel::parameters() const {
  return {network_.parameters(), adapter_.settings(), sample_period_s_};
}

Estimate AdaptiveModel::step(Features features) noexcept {
  Estimate told = network_.step(features);
  told.value = adapter_.step(network_.last_layer_input(), told.value);
  return told;
}

AnyModel::Parameters AdaptiveModel::adapted() const {
  AnyModel::Parameters parameters = network_.parameters();
  dispatch(parameters, [&](auto& own) {
    if constexpr (requires { own.layers; }) {
      dense_layers(own)->back() = adapter_.adapted();
    }
  });
  return parameters;
}

}  // namespace torsio
