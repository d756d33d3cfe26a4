#include "torsio/model/any_model.hpp"

namespace torsio {

static_assert(Model<AnyModel> && Invertible<AnyModel>);

AnyParameters::AnyParameters(std::unique_ptr<detail::HeldParameters> held) noexcept
    : held_(std::move(held)) {}
AnyParameters::AnyParameters(const AnyParameters& other) : held_(other.held_->copy()) {}
AnyParameters& AnyParameters::operator=(const AnyParameters& other) {
  if (this != &other) held_ = other.held_->copy();
  return *this;
}
AnyParameters::AnyParameters(AnyParameters&& other) noexcept = default;
AnyParameters& AnyParameters::operator=(AnyParameters&& other) noexcept = default;
AnyParameters::~AnyParameters() = default;

std::string_view AnyParameters::family() const noexcept { return held_->family(); }

AnyParameters AnyParameters::at_sample_period(double sample_period_s) const {
  return AnyParameters(held_->at_sample_period(sample_period_s));
}

AnyModel::AnyModel(const Parameters& parameters) : held_(parameters.held_->model()) {}
AnyModel::AnyModel(const AnyModel& other) : held_(other.held_->copy()) {}
AnyModel& AnyModel::operator=(const AnyModel& other) {
  if (this != &other) held_ = other.held_->copy();
  return *this;
}
AnyModel::AnyModel(AnyModel&& other) noexcept = default;
AnyModel& AnyModel::operator=(AnyModel&& other) noexcept = default;
AnyModel::~AnyModel() = default;

std::string_view AnyModel::family() const noexcept { return held_->family(); }
FamilyTraits AnyModel::traits() const noexcept { return held_->traits(); }
AnyModel::Parameters AnyModel::parameters() const { return held_->parameters(); }
std::size_t AnyModel::input_count() const noexcept { return held_->input_count(); }
std::size_t AnyModel::parameter_count() const noexcept { return held_->parameter_count(); }
double AnyModel::sample_period() const noexcept { return held_->sample_period(); }
bool AnyModel::is_rediscretised() const noexcept { return held_->is_rediscretised(); }
ModelMemory AnyModel::memory(const InputRanges& ranges) const { return held_->memory(ranges); }
void AnyModel::reset() noexcept { held_->reset(); }
Estimate AnyModel::step(Features features) noexcept { return held_->step(features); }
bool AnyModel::advance(Features features) noexcept { return held_->advance(features); }
bool AnyModel::feeds_back() const noexcept { return held_->feeds_back(); }
void AnyModel::correct(double measured) noexcept { held_->correct(measured); }
std::span<const double> AnyModel::state() const noexcept { return held_->state(); }
void AnyModel::set_state(std::span<const double> state) noexcept { held_->set_state(state); }
void AnyModel::visit_state(detail::StateBytes& bytes) noexcept { held_->visit_state(bytes); }
std::uint64_t AnyModel::state_identity() const noexcept { return held_->state_identity(); }
std::span<const float> AnyModel::last_layer_input() const noexcept {
  return held_->last_layer_input();
}
bool AnyModel::can_invert() const noexcept { return held_->can_invert(); }
Estimate AnyModel::invert(double target, Features features) noexcept {
  return held_->invert(target, features);
}

}  // namespace torsio
