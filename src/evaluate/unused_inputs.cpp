#include "evaluate/unused_inputs.hpp"

#include <algorithm>

#include "model/grey_box/grey_box.hpp"

namespace torsio {
namespace {

bool is_zero(const Matrix& values, std::size_t column) {
  for (std::size_t k = 0; k < values.rows; ++k)
    if (values(k, column) != 0.0) return false;
  return true;
}

}  // namespace

bool is_without_effect(const AnyModel& model, std::size_t input) {
  const auto* const box = model.get_if<GreyBox>();
  if (box == nullptr || input == 0) return false;
  const auto& [terms, coefficients, residual] = box->parameters();
  if (residual || (coefficients.scheduled && coefficients.feature == input)) return false;
  const bool has_bank = std::ranges::any_of(terms.banks, [&](const InputBank& bank) {
    return bank.input == input || (!bank.product_knots.empty() && bank.product_input == input);
  });
  return !has_bank && is_zero(coefficients.values, terms.first_slope() + input) &&
         is_zero(coefficients.values, terms.first_coulomb() + input);
}

std::string_view reason_to_leave_out(const EstimatorSettings& settings, const AnyModel& model,
                                     std::size_t input) {
  if (input > 0 && settings.ranges.lowest[input] == settings.ranges.highest[input])
    return "was constant in the training";
  return is_without_effect(model, input) ? "has no effect on this model" : "";
}

}  // namespace torsio
