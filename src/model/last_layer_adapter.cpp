#include "model/last_layer_adapter.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "model/network/network_checks.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

double length_of(const DenseLayer& layer) {
  double square = 0.0;
  const auto add = [&](float weight) {
    square += static_cast<double>(weight) * static_cast<double>(weight);
  };
  std::ranges::for_each(layer.weights.values, add);
  std::ranges::for_each(layer.bias, add);
  if (square == 0.0)
    throw Error({.place = "adaptation: last layer",
                 .expected = "a weight that is not 0",
                 .found = "none",
                 .advice = "Train the network first: adaptation moves a share of its weights."});
  return std::sqrt(square);
}

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

}  // namespace

LastLayerAdapter::LastLayerAdapter(const AdaptationSettings& settings, const DenseLayer& last,
                                   double target_scale, double sample_period_s)
    : ModelAdapter(settings, {AdaptationRule::nlms}, target_scale, sample_period_s),
      frozen_(last),
      bound_(settings.largest_change * length_of(last)),
      features_(last.weights.columns),
      weights_(
          (detail::require_rule(this->settings().rule, this->settings().rule != AdaptationRule::em,
                                "network", "auto, nlms or rls"),
           this->settings()),
          features_ + 1) {
  check_layer(last, features_, "adaptation: last layer");
  check_last_layer(last, "adaptation: last layer");
}

double LastLayerAdapter::step(std::span<const float> features, double frozen_value) noexcept {
  begin_step();
  if (features.size() != features_) return frozen_value;
  const auto [correction, square] = weights_.set(features);
  const double adapted = frozen_value + target_scale() * correction;
  if (!std::isfinite(adapted) || !std::isfinite(square)) return frozen_value;
  end_step(frozen_value, adapted);
  return adapted;
}

Estimate LastLayerAdapter::step(const AnyModel& model, Features /*features*/,
                                const Estimate& frozen) noexcept {
  Estimate estimate = frozen;
  estimate.value = step(model.last_layer_input(), frozen.value);
  return estimate;
}

UpdateOutcome LastLayerAdapter::update(double error) noexcept {
  if (!weights_.update(error)) count_covariance_reset();
  if (weights_.square() <= bound_ * bound_) return UpdateOutcome::updated;
  // A hair inside, so that rounding does not leave it outside.
  weights_.shrink((1.0 - 1e-12) * bound_ / std::sqrt(weights_.square()));
  return UpdateOutcome::limited;
}

double LastLayerAdapter::relative_change() const noexcept {
  return settings().largest_change * std::sqrt(weights_.square()) / bound_;
}

DenseLayer LastLayerAdapter::adapted() const {
  DenseLayer layer = frozen_;
  const auto moved = [](float weight, double by) {
    return static_cast<float>(static_cast<double>(weight) + by);
  };
  const std::span<const double> deviation = weights_.deviation();
  for (std::size_t j = 0; j < features_; ++j)
    layer.weights(0, j) = moved(layer.weights(0, j), deviation[j]);
  layer.bias.front() = moved(layer.bias.front(), deviation[features_]);
  return layer;
}

AnyParameters LastLayerAdapter::adapted(AnyParameters base) const {
  with_network(base, [&](NetworkScaling& /*scaling*/, std::vector<DenseLayer>& layers) {
    layers.back() = adapted();
  });
  return base;
}

std::unique_ptr<ModelAdapter> last_layer_adapter(const AdaptationSettings& settings,
                                                 const AnyParameters& network,
                                                 double sample_period_s) {
  std::unique_ptr<ModelAdapter> adapter;
  with_network(network, [&](const NetworkScaling& scaling, const std::vector<DenseLayer>& layers) {
    if (!layers.empty())
      adapter = std::make_unique<LastLayerAdapter>(settings, layers.back(), scaling.target_scale,
                                                   sample_period_s);
  });
  return adapter;
}

bool has_last_layer(const AnyParameters& parameters) noexcept {
  bool has = false;
  with_network(parameters, [&](const NetworkScaling& /*scaling*/,
                               const std::vector<DenseLayer>& layers) { has = !layers.empty(); });
  return has;
}

}  // namespace torsio
