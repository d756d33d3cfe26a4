#include "live/telemetry_json.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

namespace torsio {

std::string quoted_json(std::string_view text) {
  // A name from a joint may not be UTF-8.
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

TelemetryJson::TelemetryJson(const std::vector<std::string>& channels) : channels_(channels) {
  for (const std::string& each : channels) keys_.push_back(quoted_json(each) + ":");
}

std::string TelemetryJson::text_of(std::span<const float> values) const {
  std::string text = "{";
  std::array<char, 32> digits;
  for (std::size_t k = 0; k < keys_.size() && k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    if (text.size() > 1) text += ',';
    text += keys_[k];
    char* const end =
        std::to_chars(digits.data(), digits.data() + digits.size(), double{values[k]}).ptr;
    text.append(digits.data(), end);
  }
  return text + "}";
}

std::string TelemetryJson::schema() const {
  nlohmann::ordered_json properties = nlohmann::ordered_json::object();
  for (const std::string& each : channels_) properties[each] = {{"type", "number"}};
  return nlohmann::ordered_json{{"type", "object"}, {"properties", std::move(properties)}}.dump(
      -1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string plotjuggler_text(std::string_view joint, std::uint64_t time_us,
                             std::string_view values) {
  constexpr std::uint64_t kPerSecond = 1'000'000;
  return fmt::format("{{\"timestamp\":{}.{:06},{}:{}}}", time_us / kPerSecond, time_us % kPerSecond,
                     quoted_json(joint), values);
}

}  // namespace torsio
