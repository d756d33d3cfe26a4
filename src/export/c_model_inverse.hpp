#pragma once

#include "export/c_text.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Evaluations that a search of a root needs which begins with an interval, counted over recordings: for smooth curves, and
/// for those with knots and elements.
struct CRootEvaluations {
  double smooth;
  double broken;
};
[[nodiscard]] constexpr CRootEvaluations root_evaluations(CReal real) noexcept {
  return real == CReal::single ? CRootEvaluations{.smooth = 7.0, .broken = 13.0}
                               : CRootEvaluations{.smooth = 10.0, .broken = 16.0};
}

/// Writes `NAME_invert_model(state, target, x, &inverse)`, which returns a fault: the first input at which the model
/// estimates the target, the others being x, as `AnyModel::invert`. After `write_model` of the same parameters.
/// @throws UsageError for a family without an inverse
void write_model_inverse(CText& c, const AnyModel::Parameters& parameters);

/// Writes `NAME_root(s, x, wanted, low, high, error_low, error_high)`: where `NAME_error_at(s, x, wanted, z)` is 0, by secants
/// between the ends of the bracket; an end that stays twice is weighed down (Illinois).
void write_root(CText& c);

}  // namespace torsio
