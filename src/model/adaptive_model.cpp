#include "torsio/model/adaptive_model.hpp"

#include <string>

#include "model/dgmm_adapter.hpp"
#include "model/grey_box_adapter.hpp"
#include "model/last_layer_adapter.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

static_assert(Model<AdaptiveModel>);

std::unique_ptr<ModelAdapter> adapter_of(const AdaptiveModel::Parameters& parameters) {
  require_adaptable(parameters.base);
  if (const auto* const own = parameters.base.get_if<Dgmm::Parameters>())
    return std::make_unique<DgmmAdapter>(parameters.adaptation, *own, parameters.sample_period_s);
  if (const auto* const own = parameters.base.get_if<GreyBox::Parameters>())
    return std::make_unique<GreyBoxAdapter>(parameters.adaptation, *own,
                                            parameters.sample_period_s);
  return last_layer_adapter(parameters.adaptation, parameters.base, parameters.sample_period_s);
}

}  // namespace

void require_adaptable(const AnyModel::Parameters& parameters) {
  const bool is_adaptable = parameters.get_if<Dgmm::Parameters>() != nullptr ||
                            parameters.get_if<GreyBox::Parameters>() != nullptr ||
                            has_last_layer(parameters);
  if (is_adaptable) return;
  throw UsageError({.place = "adaptation",
                    .expected = "a single network (mlp, lstm, gru), a dgmm or a grey_box",
                    .found = std::string(parameters.family()),
                    .advice = "Fit one of these, without members. Other families are fitted "
                              "again."});
}

AdaptiveModel::AdaptiveModel(const Parameters& parameters)
    : model_(parameters.base),
      adapter_(adapter_of(parameters)),
      sample_period_s_(parameters.sample_period_s) {}

AdaptiveModel::AdaptiveModel(const AdaptiveModel& other)
    : model_(other.model_),
      adapter_(other.adapter_->copy()),
      sample_period_s_(other.sample_period_s_) {}

AdaptiveModel& AdaptiveModel::operator=(const AdaptiveModel& other) {
  if (this != &other) *this = AdaptiveModel(other);
  return *this;
}

AdaptiveModel::Parameters AdaptiveModel::parameters() const {
  return {model_.parameters(), adapter_->settings(), sample_period_s_};
}

AnyModel::Parameters AdaptiveModel::adapted() const {
  return adapter_->adapted(model_.parameters());
}

}  // namespace torsio
