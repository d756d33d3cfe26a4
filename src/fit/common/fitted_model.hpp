#pragma once

#include <utility>

#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fitted.hpp"

namespace torsio {

/// What a family's fitter gives, as the table of families gives it.
template <class Family>
FittedModel fitted_model(Fitted<Family> fitted) {
  return {Family(std::move(fitted.parameters)), std::move(fitted.notes), std::move(fitted.table)};
}

}  // namespace torsio
