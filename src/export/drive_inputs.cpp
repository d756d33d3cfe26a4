#include "export/drive_inputs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string_view>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr const char* kWantedInputs =
    "joint_target_rad - joint_angle_rad and joint_speed_rad_s, each with the same lags: lag(x, n)";

std::string without_blanks(std::string text) {
  std::erase_if(text, [](char letter) { return letter == ' ' || letter == '\t'; });
  return text;
}

/// "lag(x, 2)" is x and 2.
std::pair<std::string, std::size_t> without_lag(const std::string& expression) {
  constexpr std::string_view kLag = "lag(";
  const std::size_t comma = expression.rfind(',');
  if (!expression.starts_with(kLag) || !expression.ends_with(')') || comma == std::string::npos)
    return {expression, 0};
  const std::string ticks = expression.substr(comma + 1, expression.size() - comma - 2);
  if (ticks.empty() || ticks.find_first_not_of("0123456789") != std::string::npos ||
      ticks.size() > 6)
    return {expression, 0};
  std::string of = expression.substr(kLag.size(), comma - kLag.size());
  if (of.starts_with('(') && of.ends_with(')')) of = of.substr(1, of.size() - 2);
  return {of, static_cast<std::size_t>(std::strtoul(ticks.c_str(), nullptr, 10))};
}

}  // namespace

DriveInputs drive_inputs(const ModelFile& model, const std::string& place) {
  std::map<std::string, std::string> definitions;
  for (const ChannelDefinition& each : model.settings.features.definitions)
    definitions[each.name] = without_blanks(each.expression);
  std::map<std::size_t, std::size_t> errors;
  std::map<std::size_t, std::size_t> speeds;
  const std::vector<std::string>& inputs = model.settings.features.inputs;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    auto [of, lag] = without_lag(without_blanks(inputs[i]));
    if (const auto defined = definitions.find(of); defined != definitions.end())
      of = defined->second;
    if (of == "joint_target_rad-joint_angle_rad")
      errors[lag] = i;
    else if (of == "joint_speed_rad_s")
      speeds[lag] = i;
    else
      throw UsageError(
          {.place = place,
           .expected = kWantedInputs,
           .found = inputs[i],
           .advice = "Train a network with these inputs, or export it without a layout."});
  }
  DriveInputs result;
  for (const auto& [lag, index] : errors) {
    const auto speed = speeds.find(lag);
    if (speed == speeds.end()) break;
    result.lags.push_back(lag);
    result.position_errors.push_back(index);
    result.speeds.push_back(speed->second);
  }
  if (result.lags.size() != errors.size() || 2 * result.lags.size() != inputs.size())
    throw UsageError(
        {.place = place,
         .expected = kWantedInputs,
         .found = fmt::format("{}", fmt::join(inputs, ", ")),
         .advice = "Train a network with these inputs, or export it without a layout."});
  return result;
}

}  // namespace torsio
