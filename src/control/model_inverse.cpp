#include "torsio/control/model_inverse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "spring inverse";
constexpr std::string_view kDeflection = "spring_deflection_rad";
constexpr std::string_view kTorque = "torque_Nm";

EstimatorSettings checked(EstimatorSettings settings, const AnyModel& model) {
  if (!model.can_invert())
    refuse(kPlace, "a family with an inverse", fmt::format("'{}'", model.family()),
           "Train one the other way round: --target spring_deflection_rad.");
  const std::vector<std::string>& inputs = settings.features.inputs;
  if (inputs.empty() || inputs.front() != kDeflection)
    refuse(kPlace, fmt::format("{} as the first input", kDeflection),
           inputs.empty() ? "no input" : fmt::format("'{}'", inputs.front()));
  if (settings.fallback.slope.empty() || !(settings.fallback.slope.front() > 0.0))
    refuse(kPlace, "a fallback whose torque rises with the deflection", "one that does not");
  return settings;
}

double departure_rad(const EstimatorSettings& settings, double max_departure) {
  require_parameter(max_departure >= 0.0, kPlace, "max_departure >= 0", max_departure);
  const double residual_Nm = settings.fallback.residual_std;
  return std::isfinite(residual_Nm) ? max_departure * residual_Nm / settings.fallback.slope.front()
                                    : std::numeric_limits<double>::infinity();
}

/// Index of the torque among the raw inputs of an inverse model.
std::size_t torque_place(const Estimator& estimator) {
  if (estimator.settings().target != kDeflection)
    refuse(kPlace, fmt::format("a model whose target is {}", kDeflection),
           fmt::format("the target '{}'", estimator.settings().target));
  for (const std::string& channel : estimator.settings().zeroed_channels)
    if (channel == "gear_angle_rad" || channel == "joint_angle_rad" || channel == kDeflection)
      refuse(kPlace, "a deflection as it is measured",
             fmt::format("one relative to the zero of {}", channel),
             "Train it without zero rules for the angles, or train a model of the torque, which "
             "can be inverted.");
  const auto place = std::ranges::find(estimator.raw_inputs(), kTorque);
  if (place == estimator.raw_inputs().end())
    refuse(kPlace, fmt::format("a model with {} among its inputs", kTorque),
           fmt::format("{}", fmt::join(estimator.raw_inputs(), ", ")));
  return static_cast<std::size_t>(place - estimator.raw_inputs().begin());
}

std::vector<std::string> without_torque(std::vector<std::string> raw_inputs) {
  std::erase(raw_inputs, kTorque);
  return raw_inputs;
}

}  // namespace

ModelInverse::ModelInverse(EstimatorSettings settings, AnyModel model, double max_departure)
    : core_(checked(std::move(settings), model), model),
      model_(std::move(model)),
      inputs_(core_.raw_inputs(), core_.settings().target),
      max_departure_rad_(departure_rad(core_.settings(), max_departure)),
      is_stepped_(core_.model_has_memory()),
      asked_(model_.input_count()) {
  reset();
}

void ModelInverse::reset() noexcept {
  core_.reset();
  model_.reset();
  is_asked_ = false;
  follows_answer_ = false;
  last_rad_ = 0.0;
}

void ModelInverse::store(Features features) noexcept {
  if (!model_.advance(features)) model_.reset();
}

double ModelInverse::on_the_line(double torque_Nm, Features features) const noexcept {
  const LinearFallback& line = core_.settings().fallback;
  double rest_Nm = torque_Nm - line.intercept;
  for (std::size_t j = 1; j < features.size(); ++j) rest_Nm -= line.slope[j] * features[j];
  return rest_Nm / line.slope.front();
}

// The verdict of an estimator, at the deflection that is requested in place of the measured one.
Estimate ModelInverse::guarded(double torque_Nm, const Core::Conditioned& input) noexcept {
  const double line_rad = on_the_line(torque_Nm, input.features);
  Estimate answer = {.value = line_rad};
  if (core_.is_in_jump()) {
    answer.fault = Fault::outside_training_range;
    return answer;
  }
  const Estimate inverted = model_.invert(torque_Nm, input.for_model);
  answer.novelty = inverted.novelty;
  std::ranges::copy(input.features, asked_.begin());
  const bool has_inverse = inverted.fault == Fault::none && std::isfinite(inverted.value);
  asked_.front() = has_inverse ? inverted.value : line_rad;
  Core::Excursion excursion = core_.excursion(asked_);
  // At a rate beyond its range an estimator uses the model, a loop the line (docs/decisions/0027-beyond-the-range.md).
  excursion.fallback = std::max(excursion.fallback, excursion.rate);
  answer.fault = core_.replaced_for(excursion, inverted, core_.residual_std_at(torque_Nm));
  if (answer.fault != Fault::none) return answer;
  answer.value = std::max(std::min(inverted.value, line_rad + max_departure_rad_),
                          line_rad - max_departure_rad_);
  answer.std_dev = inverted.std_dev;
  if (excursion.verdict() == Core::Verdict::blend)
    answer.value = std::lerp(answer.value, line_rad, excursion.fallback);
  if (excursion.share > 0.0)
    answer.std_dev = Core::widened(answer.std_dev, excursion, answer.value - line_rad);
  if (excursion.is_outside()) answer.fault = Fault::outside_training_range;
  return answer;
}

Estimate ModelInverse::step(double torque_Nm, const JointSample& sample) noexcept {
  if (is_asked_) store(asked_);
  is_asked_ = false;
  follows_answer_ = false;
  const Core::Conditioned input = core_.condition(inputs_.from(sample));
  if (input.fault == Fault::outside_training_range && std::isfinite(torque_Nm))
    return {.value = on_the_line(torque_Nm, {}), .fault = input.fault};
  if (input.fault != Fault::none || !std::isfinite(torque_Nm))
    return {.value = last_rad_,
            .fault = input.fault != Fault::none ? input.fault : Fault::input_not_finite};
  if (input.restarted) model_.reset();
  const bool has_state = !model_.state().empty();
  const bool is_received = !input.for_model.empty();
  if (is_stepped_ && !has_state && is_received) store(input.for_model);
  Estimate answer = guarded(torque_Nm, input);
  zero_rad_ = sample.spring_deflection_rad() - input.features.front();
  if (has_state && is_received) {
    // What the loop makes of the answer is not known yet: the memory goes there in the next step.
    std::ranges::copy(input.for_model, asked_.begin());
    follows_answer_ = answer.fault != Fault::warming_up;
    if (follows_answer_) asked_.front() = answer.value;
    is_asked_ = true;
  }
  if (!core_.unset_zeros().empty() && answer.fault != Fault::wrong_rate)
    answer.fault = Fault::zero_not_set;
  // The model's deflection lies off the measured one by the zeros of its channels.
  answer.value += zero_rad_;
  if (!std::isfinite(answer.value)) return {.value = last_rad_, .fault = Fault::model_not_finite};
  last_rad_ = answer.value;
  return answer;
}

TrainedInverse::TrainedInverse(Estimator estimator)
    : estimator_(std::move(estimator)),
      torque_(torque_place(estimator_)),
      others_(without_torque(estimator_.raw_inputs()), std::string(kTorque)),
      raw_(estimator_.raw_inputs().size()) {}

Estimate TrainedInverse::step(double torque_Nm, const JointSample& sample) noexcept {
  const std::span<const double> others = others_.from(sample);
  std::ranges::copy(others.first(torque_), raw_.begin());
  raw_[torque_] = torque_Nm;
  std::ranges::copy(others.subspan(torque_),
                    raw_.begin() + static_cast<std::ptrdiff_t>(torque_) + 1);
  return estimator_.step(raw_);
}

AnyInverse AnyInverse::of(const EstimatorSettings& settings,
                          const AnyModel::Parameters& parameters) {
  if (settings.target == kDeflection)
    return TrainedInverse(Estimator(settings, AnyModel(parameters)));
  return ModelInverse(settings, AnyModel(parameters));
}

void AnyInverse::set_zero(std::string_view channel, double value) {
  std::visit(
      [&](auto& inverse) {
        if constexpr (requires { inverse.set_zero(channel, value); })
          inverse.set_zero(channel, value);
      },
      inverse_);
}

}  // namespace torsio
