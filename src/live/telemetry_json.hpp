#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// Values of a joint as a JSON object: {"torque_Nm":0.5,"current_A":-1e-07}.
class TelemetryJson {
 public:
  explicit TelemetryJson(const std::vector<std::string>& channels);

  /// Each number with the fewest digits that give the same double again; one that is not finite is left out.
  [[nodiscard]] std::string text_of(std::span<const float> values) const;
  /// The JSON schema of these objects.
  [[nodiscard]] std::string schema() const;

 private:
  std::vector<std::string> channels_;
  std::vector<std::string> keys_ = {};  ///< "\"torque_Nm\":"
};

/// {"timestamp":1764349382.000500,"elbow":{...}}. @param values of `TelemetryJson`
[[nodiscard]] std::string plotjuggler_text(std::string_view joint, std::uint64_t time_us,
                                           std::string_view values);

/// As a text of JSON, with its quotes.
[[nodiscard]] std::string quoted_json(std::string_view text);

}  // namespace torsio
