#pragma once

#include <concepts>
#include <cstdio>
#include <string>
#include <type_traits>
#include <vector>

#include "model/common/parameters.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {

/// The dump of parameters whose family is known only at run time; defined in support/dump_any.hpp.
std::string dump(const AnyParameters& parameters);

/// Every leaf of a set of parameters, written out exactly.
template <class Parameters>
std::string dump(const Parameters& parameters) {
  std::string text;
  const auto number = [&text](double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, " %a", value);
    text += buffer;
  };
  for_each_leaf(parameters, [&](const std::string& path, const auto& leaf) {
    using Leaf = std::remove_cvref_t<decltype(leaf)>;
    text += '\n' + path;
    const auto numbers = [&](const auto& values) {
      for (const auto value : values) number(static_cast<double>(value));
    };
    if constexpr (std::same_as<Leaf, Matrix> || std::same_as<Leaf, FloatMatrix>) {
      text += ' ' + std::to_string(leaf.rows) + 'x' + std::to_string(leaf.columns);
      numbers(leaf.values);
    } else if constexpr (std::same_as<Leaf, std::vector<double>> ||
                         std::same_as<Leaf, std::vector<float>>) {
      numbers(leaf);
    } else {
      number(static_cast<double>(leaf));
    }
  });
  return text;
}

}  // namespace torsio::test
