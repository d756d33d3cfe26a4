#include "evaluate/model_label.hpp"

#include <fmt/format.h>

namespace torsio {

std::string model_label(std::string_view family, std::string_view variant) {
  return variant.empty() ? std::string(family) : fmt::format("{}[{}]", family, variant);
}

std::string model_label(const ResultRow& row) {
  const std::string label = model_label(row.family, row.variant);
  return row.input_set.empty() ? label : fmt::format("{} ({})", label, row.input_set);
}

}  // namespace torsio
