#include "torsio/core/provenance.hpp"

#include <fmt/format.h>

#include "torsio/core/units.hpp"

namespace torsio {

std::string uncertainty_text(const SensorUncertainty& sensor, std::string_view channel) {
  if (!sensor.is_stated()) return {};
  const std::string constant = fmt::format("{:.2g} {}", sensor.constant, unit_label(channel));
  const std::string relative = fmt::format("{:.2g} % of the value", 100.0 * sensor.relative);
  std::string text = sensor.constant > 0.0 ? constant : relative;
  if (sensor.constant > 0.0 && sensor.relative > 0.0)
    text = fmt::format("sqrt(({})^2 + ({})^2)", constant, relative);
  return text + " (standard uncertainty)";
}

}  // namespace torsio
