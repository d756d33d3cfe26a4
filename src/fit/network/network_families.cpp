#include "fit/network/network_families.hpp"

#include "fit/common/fitted_model.hpp"
#include "fit/network/fit_network.hpp"

namespace torsio {
namespace {

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
FittedModel fit(const TrainingData& data, const WithMembers<Network>& options,
                const FitContext& context) {
  if (options.members == 1) return fitted_model(kFit(data, options.network, context));
  return fitted_model(kFitEnsemble(data, options.network, options.members, context));
}

}  // namespace

std::vector<FamilyInfo> network_families() {
  return {family_of<fit<fit_mlp, fit_mlp_ensemble, MlpOptions>>(
              {.name = Mlp::kFamily,
               .summary = "neural network without memory",
               .can_resume = true,
               .variations = {{"layers", "16-16"}, {"layers", "50-10-5"}}}),
          family_of<fit<fit_gru, fit_gru_ensemble, RecurrentOptions>>(
              {.name = Gru::kFamily,
               .summary = "neural network with memory: gated recurrent units",
               .can_resume = true,
               .only_if_named = true}),
          family_of<fit<fit_lstm, fit_lstm_ensemble, RecurrentOptions>>(
              {.name = Lstm::kFamily,
               .summary = "neural network with memory: long short-term memory",
               .can_resume = true,
               .only_if_named = true})};
}

}  // namespace torsio
