#include "control/temperature_derating.hpp"

#include <fmt/format.h>

#include "core/checks.hpp"

namespace torsio {

TemperatureDerating::TemperatureDerating(double begins_K, double ends_K)
    : begins_K_(begins_K), ends_K_(ends_K) {
  constexpr auto kPlace = "temperature derating";
  require_positive(kPlace, "begins_K", begins_K);
  require_parameter(ends_K > begins_K && std::isfinite(ends_K), kPlace,
                    fmt::format("an end above its beginning, {} K", begins_K), ends_K);
}

}  // namespace torsio
