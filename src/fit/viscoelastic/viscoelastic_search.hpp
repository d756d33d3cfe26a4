#pragma once

#include <string>
#include <vector>

#include "fit/viscoelastic/fit_viscoelastic.hpp"
#include "fit/viscoelastic/viscoelastic_error.hpp"
#include "numerics/residual_search.hpp"
#include "torsio/fit/common/fit_context.hpp"

namespace torsio {

/// Values of a network's elements and the offset that fit training data, and how they were found.
struct ViscoelasticFit {
  SpringDashpotNetwork network;
  double offset = 0.0;
  std::vector<std::string> notes = {};
};

/// The search of `fit_viscoelastic`. @throws Error, UsageError and Cancelled as that.
[[nodiscard]] ViscoelasticFit search_network(const ViscoelasticError& error,
                                             const SpringDashpotNetwork& network,
                                             const ViscoelasticOptions& options,
                                             const FitContext& context);

/// The network's own values; the offset alone is fitted.
/// @throws UsageError if a value is missing.
[[nodiscard]] ViscoelasticFit offset_of_network(const ViscoelasticError& error,
                                                const SpringDashpotNetwork& network);

/// How well the data determine the values and, last, the offset.
[[nodiscard]] ParameterUncertainty uncertainty_of(const ViscoelasticError& error,
                                                  const ViscoelasticFit& fit);

/// Springs and dashpots, in the order of the text.
[[nodiscard]] std::vector<const NetworkNode*> elements_of(const SpringDashpotNetwork& network);

}  // namespace torsio
