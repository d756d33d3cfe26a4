#pragma once

#include <cstddef>

#include "fit/common/fitted_model.hpp"
#include "model/network/ensemble.hpp"

namespace torsio {

/// A network, or an ensemble of such networks.
template <class Network>
struct WithMembers {
  Network network = {};
  std::size_t members = 1;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    Network::visit_options(self.network, visit);
    visit(self.members, {.name = "members",
                         .minimum = 1,
                         .maximum = MlpEnsemble::kMaxMembers,
                         .help = "networks of an ensemble, whose mean is the estimate and whose "
                                 "disagreement widens the error bar"});
  }
};

template <auto kFit, auto kFitEnsemble, class Network>
FittedModel fit_members(const TrainingData& data, const WithMembers<Network>& options,
                        const FitContext& context) {
  if (options.members == 1) return fitted_model(kFit(data, options.network, context));
  return fitted_model(kFitEnsemble(data, options.network, options.members, context));
}

}  // namespace torsio
