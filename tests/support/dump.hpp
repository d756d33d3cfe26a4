#pragma once

#include <concepts>
#include <cstdio>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/model/parameters.hpp"

namespace torsio::test {

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
    if constexpr (std::same_as<Leaf, Matrix>) {
      text += ' ' + std::to_string(leaf.rows) + 'x' + std::to_string(leaf.columns);
      for (const double value : leaf.values) number(value);
    } else if constexpr (std::same_as<Leaf, std::vector<double>>) {
      for (const double value : leaf) number(value);
    } else {
      number(static_cast<double>(leaf));
    }
  });
  return text;
}

inline std::string dump(const AnyModel::Parameters& parameters) {
  return std::visit([](const auto& own) { return dump(own); }, parameters);
}

}  // namespace torsio::test
