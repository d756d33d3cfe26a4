#include "fit/network/network_families.hpp"

#include "fit/network/fit_network.hpp"
#include "fit/network/network_members.hpp"

namespace torsio {
std::vector<FamilyInfo> network_families() {
  return {family_of<fit_members<fit_mlp, fit_mlp_ensemble, MlpOptions>>(
              {.name = Mlp::kFamily,
               .summary = "neural network without memory",
               .can_resume = true,
               .variations = {{"layers", "16-16"}, {"layers", "50-10-5"}}}),
          family_of<fit_members<fit_gru, fit_gru_ensemble, RecurrentOptions>>(
              {.name = Gru::kFamily,
               .summary = "neural network with memory: gated recurrent units",
               .can_resume = true,
               .only_if_named = true}),
          family_of<fit_members<fit_lstm, fit_lstm_ensemble, RecurrentOptions>>(
              {.name = Lstm::kFamily,
               .summary = "neural network with memory: long short-term memory",
               .can_resume = true,
               .only_if_named = true})};
}

}  // namespace torsio
