#include "model/network/mlp.hpp"

#include <string>
#include <utility>

#include "model/network/network_checks.hpp"

namespace torsio {

Mlp::Mlp(Parameters parameters)
    : parameters_(std::move(parameters)),
      layers_(parameters_.layers,
              checked_input_count(parameters_.scaling, std::string(kFamily) + ": scaling"),
              std::string(kFamily) + ": layers"),
      input_(padded_count(input_count()), 0.0F) {}

Estimate Mlp::step(Features features) noexcept {
  standardise(parameters_.scaling, features, input_.data());
  return {.value = destandardise(parameters_.scaling, layers_.evaluate(input_.data()))};
}

}  // namespace torsio
