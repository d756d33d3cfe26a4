#include "checks.hpp"

#include <fmt/format.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {

void require(bool holds, std::string_view place, const std::string& expected, double found) {
  if (holds) return;
  throw Error({.place = std::string(place),
               .problem = "impossible parameter",
               .expected = expected,
               .found = fmt::format("{}", found)});
}

void require_positive(std::string_view place, std::string_view name, double value) {
  require(value > 0.0 && std::isfinite(value), place, fmt::format("{} > 0 and finite", name),
          value);
}

void require_not_negative(std::string_view place, std::string_view name, double value) {
  require(value >= 0.0 && std::isfinite(value), place, fmt::format("{} >= 0 and finite", name),
          value);
}

}  // namespace torsio
