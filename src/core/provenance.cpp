#include "torsio/core/provenance.hpp"

#include <fmt/format.h>

#include "torsio/core/units.hpp"

namespace torsio {

std::string uncertainty_text(const SensorUncertainty& sensor, std::string_view channel) {
  if (!sensor.is_stated()) return {};
  std::string text;
  if (sensor.constant > 0.0) text = fmt::format("{:.2g} {}", sensor.constant, unit_label(channel));
  if (sensor.relative > 0.0)
    text +=
        fmt::format("{}{:.2g} % of the value", text.empty() ? "" : " + ", 100.0 * sensor.relative);
  return text + " (standard uncertainty)";
}

}  // namespace torsio
