#include "torsio/model/adaptive_model.hpp"

#include <string>
#include <vector>

#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

static_assert(Model<AdaptiveModel>);

/// Calls `use` with the scaling and the dense layers of a network; not at all with other families.
template <class Parameters, class Use>
void with_network(Parameters& parameters, const Use& use) {
  if (auto* const mlp = parameters.template get_if<Mlp::Parameters>())
    use(mlp->scaling, mlp->layers);
  else if (auto* const lstm = parameters.template get_if<Lstm::Parameters>())
    use(lstm->scaling, lstm->head);
  else if (auto* const gru = parameters.template get_if<Gru::Parameters>())
    use(gru->scaling, gru->head);
}

LastLayerAdapter adapter_of(const AdaptiveModel::Parameters& parameters) {
  double target_scale = 1.0;
  with_network(parameters.network,
               [&](const NetworkScaling& scaling, const std::vector<DenseLayer>& /*layers*/) {
                 target_scale = scaling.target_scale;
               });
  return {parameters.adaptation, require_last_layer(parameters.network), target_scale,
          parameters.sample_period_s};
}

}  // namespace

const DenseLayer* last_layer(const AnyModel::Parameters& parameters) noexcept {
  const DenseLayer* last = nullptr;
  with_network(parameters,
               [&](const NetworkScaling& /*scaling*/, const std::vector<DenseLayer>& layers) {
                 if (!layers.empty()) last = &layers.back();
               });
  return last;
}

const DenseLayer& require_last_layer(const AnyModel::Parameters& parameters) {
  if (const DenseLayer* const last = last_layer(parameters)) return *last;
  throw UsageError({.place = "adaptation",
                    .expected = "a network: mlp, lstm or gru",
                    .found = std::string(parameters.family()),
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
  Estimate estimate = network_.step(features);
  estimate.value = adapter_.step(network_.last_layer_input(), estimate.value);
  return estimate;
}

AnyModel::Parameters AdaptiveModel::adapted() const {
  AnyModel::Parameters parameters = network_.parameters();
  with_network(parameters, [&](NetworkScaling& /*scaling*/, std::vector<DenseLayer>& layers) {
    layers.back() = adapter_.adapted();
  });
  return parameters;
}

}  // namespace torsio
