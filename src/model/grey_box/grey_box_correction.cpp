#include "model/grey_box/grey_box_correction.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::string_view kPlace = "grey_box";

/// What `use` returns of the model.
template <class Model, class Use>
auto of_model(Model& model, const Use& use) noexcept -> decltype(use(*std::get_if<Mlp>(&model))) {
  if (auto* const mlp = std::get_if<Mlp>(&model)) return use(*mlp);
  if (auto* const products = std::get_if<InputProducts>(&model)) return use(*products);
  if (auto* const process = std::get_if<ParametricGp>(&model)) return use(*process);
  if (auto* const dgmm = std::get_if<Dgmm>(&model)) return use(*dgmm);
  return {};
}

}  // namespace

GreyBoxCorrection::GreyBoxCorrection(const GreyBoxResidual& residual)
    : bound_(residual.bound), lowest_(residual.lowest), highest_(residual.highest) {
  std::visit([this]<class P>(const P& own) { model_.emplace<typename P::Family>(own); },
             residual.model);
  const std::size_t inputs =
      of_model(model_, [](const auto& model) { return model.input_count(); });
  require(lowest_.size() == inputs && highest_.size() == inputs, {kPlace, "residual range"},
          std::to_string(inputs) + " limits, one for each input of its model",
          std::to_string(lowest_.size()) + " and " + std::to_string(highest_.size()));
  for (std::size_t j = 0; j < inputs; ++j)
    require(std::isfinite(lowest_[j]) && std::isfinite(highest_[j]) && lowest_[j] <= highest_[j],
            {kPlace, "residual range"}, "lowest <= highest",
            as_text(lowest_[j]) + ", " + as_text(highest_[j]));
  require(std::isfinite(bound_) && bound_ >= 0.0, {kPlace, "residual bound"}, "a number >= 0",
          bound_);
}

std::size_t GreyBoxCorrection::parameter_count() const noexcept {
  return of_model(model_, [](const auto& model) { return model.parameter_count(); });
}

double GreyBoxCorrection::value(std::span<const double> inputs) noexcept {
  double share = 1.0;
  for (std::size_t j = 0; j < inputs.size(); ++j) {
    const double low = lowest_[j];
    const double high = highest_[j];
    const double left_by = std::max(low - inputs[j], inputs[j] - high);
    if (left_by <= 0.0) continue;
    const double border = GreyBoxResidual::kBorder * (high - low);
    if (!(left_by < border)) return 0.0;  // NaN too
    share = std::min(share, 1.0 - left_by / border);
  }
  const double correction =
      of_model(model_, [inputs](auto& model) { return model.step(inputs).value; });
  if (!std::isfinite(correction)) return 0.0;
  return share * std::min(std::max(correction, -bound_), bound_);
}

}  // namespace torsio
