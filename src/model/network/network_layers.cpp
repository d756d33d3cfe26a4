#include "torsio/model/network/network_layers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, 5> kNames{"linear", "relu", "tanh", "softsign", "elu"};

}  // namespace

std::string_view name(Activation activation) noexcept {
  return kNames[static_cast<std::size_t>(activation)];
}

Activation activation_of(std::string_view name) {
  const auto* const found = std::ranges::find(kNames, name);
  if (found == kNames.end())
    throw UsageError({.problem = fmt::format("no activation is called \"{}\"", name),
                      .expected = fmt::format("one of {}", fmt::join(kNames, ", "))});
  return static_cast<Activation>(found - kNames.begin());
}

std::size_t weight_count(const DenseLayer& layer) noexcept {
  return layer.weights.values.size() + layer.bias.size();
}

std::size_t weight_count(const LstmLayer& layer) noexcept {
  return layer.input_weights.values.size() + layer.recurrent_weights.values.size() +
         layer.bias.size();
}

std::size_t weight_count(const GruLayer& layer) noexcept {
  return layer.input_weights.values.size() + layer.recurrent_weights.values.size() +
         layer.input_bias.size() + layer.recurrent_bias.size();
}

}  // namespace torsio
