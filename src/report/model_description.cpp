#include "report/model_description.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <vector>

#include "files/known_families.hpp"
#include "files/load_target_json.hpp"
#include "model/common/parameters.hpp"
#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/model/network/network_layers.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using DescriptionJson = nlohmann::ordered_json;

constexpr std::size_t kReadable = 32;

/// A tensor of the model, as a list of numbers.
struct Leaf {
  std::string name;
  std::string shape;
  std::vector<double> values;
};

Leaf leaf_of(const std::string& name, const Matrix& matrix) {
  return {name, fmt::format("{} x {}", matrix.rows, matrix.columns), matrix.values};
}
Leaf leaf_of(const std::string& name, const std::vector<double>& values) {
  return {name, fmt::format("{}", values.size()), values};
}
Leaf leaf_of(const std::string& name, const FloatMatrix& matrix) {
  return {name,
          fmt::format("{} x {}", matrix.rows, matrix.columns),
          {matrix.values.begin(), matrix.values.end()}};
}
Leaf leaf_of(const std::string& name, const std::vector<float>& values) {
  return {name, fmt::format("{}", values.size()), {values.begin(), values.end()}};
}
template <class Number>
Leaf leaf_of(const std::string& name, const Number& value) {
  return {name, "1", {static_cast<double>(value)}};
}

std::vector<Leaf> leaves_of(const ModelFile& model) {
  std::vector<Leaf> leaves;
  with_own_type(model.parameters, [&](const auto& parameters) {
    for_each_leaf(parameters, [&](const std::string& name, const auto& value) {
      leaves.push_back(leaf_of(name, value));
    });
  });
  return leaves;
}

/// "layers.0" of "layers.0.weights"; empty outside lists.
std::string_view list_element(std::string_view name) {
  const std::size_t point = name.rfind('.');
  if (point == std::string_view::npos) return {};
  const std::string_view element = name.substr(0, point);
  const std::string_view index = element.substr(element.rfind('.') + 1);
  return index.find_first_not_of("0123456789") == std::string_view::npos ? element
                                                                         : std::string_view();
}

/// The name of a field without the signs of a programming language: "layers 0".
std::string in_words(std::string_view field) {
  std::string words(field);
  for (char& letter : words)
    if (letter == '_' || letter == '.') letter = ' ';
  return words;
}

/// The names of a list's fields without their numbers.
std::string outline(const Leaf& leaf) {
  const std::string field = leaf.name.substr(leaf.name.rfind('.') + 1);
  if (field == "activation") return std::string(name(static_cast<Activation>(leaf.values.front())));
  return fmt::format("{} {}", in_words(field), leaf.shape);
}

/// One line per number or table; one line per element of a list (a layer of a network).
std::string parameter_lines(const std::vector<Leaf>& leaves) {
  std::vector<std::string> lines;
  std::string_view last;
  for (const Leaf& leaf : leaves) {
    const std::string_view element = list_element(leaf.name);
    if (!element.empty() && element == last) {
      lines.back().append(", ").append(outline(leaf));
    } else if (!element.empty()) {
      lines.push_back(fmt::format("{}: {}", in_words(element), outline(leaf)));
    } else if (leaf.values.size() <= kReadable) {
      lines.push_back(
          fmt::format("{} = {:.6g}", in_words(leaf.name), fmt::join(leaf.values, ", ")));
    } else {
      lines.push_back(fmt::format("{}: {} numbers", in_words(leaf.name), leaf.shape));
    }
    last = element;
  }
  return fmt::format("{}\n", fmt::join(lines, "\n"));
}

/// The description by the first family with such models.
ParameterDescription description_of(const ModelFile& model) {
  const std::string_view of = model.parameters.family();
  for (const FamilyInfo& family : families())
    if (family.model_family == of && family.describe != nullptr)
      return family.describe(model.parameters, model.settings);
  return {};
}

std::string coefficient_table(const std::vector<FittedParameter>& description) {
  TextTable table;
  table.header({"parameter", "value", "unit"});
  for (const FittedParameter& each : description)
    table.row({each.name, fmt::format("{:.6g}", each.value), each.unit});
  return table.text();
}

/// A network of another program has no range of its inputs.
bool is_open(double limit) { return std::abs(limit) >= kOpenRange; }

std::string range_table(const EstimatorSettings& settings) {
  TextTable inputs;
  inputs.header({"input", "lowest", "highest trained on"});
  bool has_open = false;
  const auto limit = [&](double value) {
    has_open = has_open || is_open(value);
    return is_open(value) ? std::string("open") : fmt::format("{:.4g}", value);
  };
  for (std::size_t j = 0; j < settings.features.inputs.size(); ++j)
    inputs.row({settings.features.inputs[j], limit(settings.ranges.lowest[j]),
                limit(settings.ranges.highest[j])});
  return inputs.text() + (has_open ? "open: the range of the training data is not known; the model "
                                     "has no range guard there\n"
                                   : "");
}

/// The scores of the card by the names that the tables use, with their unit.
std::string score_line(const ModelFile& model) {
  if (model.card.metrics.empty()) return {};
  struct Score {
    std::string_view key;
    std::string_view title;
    bool has_unit = true;
  };
  constexpr auto kScores = std::to_array<Score>({{"rmse", "RMSE"},
                                                 {"mad", "MAD"},
                                                 {"std_abs", "standard deviation of |e|"},
                                                 {"max_abs", "max|e|"},
                                                 {"fit_percent", "fit %", false}});
  const std::string unit = unit_label(model.settings.target);
  std::string text;
  for (const auto& [key, value] : model.card.metrics) {
    const auto* const known = std::ranges::find(kScores, key, &Score::key);
    const std::string title = known == kScores.end() ? in_words(key) : std::string(known->title);
    const bool has_unit = known != kScores.end() && known->has_unit && !unit.empty();
    text += fmt::format("{}{} {:.4g}{}", text.empty() ? "" : ", ", title, value,
                        has_unit ? fmt::format(" {}", unit) : "");
  }
  return fmt::format("errors on {}: {}\n", model.card.held_out, text);
}

/// @param begin of the options that a transfer or an adaptation has noted.
std::string noted_options(const ModelCard& card, std::string_view begin, std::string_view title) {
  std::string text;
  for (const auto& [option, value] : card.options)
    if (option.starts_with(begin))
      text += fmt::format("{} {}", text.empty() ? title : ",",
                          in_words(option.substr(begin.size())) + " " + value);
  return text.empty() ? text : text + "\n";
}

std::string adaptation_lines(const ModelCard& card) {
  return noted_options(card, "transfer.", "transferred with") +
         noted_options(card, "adaptation.", "adapted with");
}

std::string mapping_lines(const ModelCard& card) {
  if (card.mapping.empty()) return {};
  std::string text = "recordings are read with this mapping, unless --mapping gives another:\n";
  std::istringstream lines(card.mapping);
  for (std::string line; std::getline(lines, line);) text += fmt::format("  {}\n", line);
  return text;
}

std::string load_lines(const ModelCard& card) {
  if (!card.load_target.is_used()) return {};
  return fmt::format("{}\n", fmt::join(load_target_notes(card.load_target), "\n"));
}

std::string sensor_line(const EstimatorSettings& settings) {
  const std::string text = uncertainty_text(settings.target_uncertainty, settings.target);
  if (text.empty()) return {};
  return fmt::format(
      "reference sensor: {}, as stated with the recordings; part of the error bars\n", text);
}

nlohmann::ordered_json sensor_json(const EstimatorSettings& settings) {
  const SensorUncertainty& sensor = settings.target_uncertainty;
  if (!sensor.is_stated()) return nullptr;
  return {{"constant", sensor.constant}, {"relative", sensor.relative}};
}

std::string cycle_text(const SlowCycle& cycle) {
  if (!cycle.reason.empty())
    return fmt::format("stiffness, loop width and friction cannot be determined: {}\n",
                       cycle.reason);
  std::string held;
  for (const auto& [channel, value] : cycle.held)
    held += fmt::format(", {} = {:.4g}", channel, value);
  const std::string at_zero =
      std::isnan(cycle.width_at_zero_Nm)
          ? std::string()
          : fmt::format("{:.4g} Nm at zero deflection, ", cycle.width_at_zero_Nm);
  TextTable table;
  table.header({"deflection rad", "torque Nm", "stiffness Nm/rad", "loop width Nm", "friction Nm"});
  for (const SlowCycle::Point& point : cycle.points)
    table.row({fmt::format("{:.4g}", point.deflection_rad), fmt::format("{:.4g}", point.torque_Nm),
               fmt::format("{:.4g}", point.stiffness_Nm_rad),
               fmt::format("{:.4g}", point.loop_width_Nm),
               fmt::format("{:.4g}", point.friction_Nm)});
  return fmt::format(
      "slow cycle of the model: a triangle of {:g} s over the trained deflections, {:.4g} to "
      "{:.4g} rad, joint at rest{}\n"
      "stiffness {:.4g} Nm/rad (line through the mean of both directions)\n"
      "loop width {}at most {:.4g} Nm (at {:.4g} rad)\n"
      "friction {:.4g} Nm (half of the mean loop width)\n{}",
      cycle.period_s, cycle.lowest_rad, cycle.highest_rad, held, cycle.stiffness_Nm_rad, at_zero,
      cycle.largest_width_Nm, cycle.largest_width_at_rad, cycle.friction_Nm, table.text());
}

nlohmann::ordered_json cycle_json(const SlowCycle& cycle) {
  if (!cycle.reason.empty()) return {{"status", "undetermined"}, {"reason", cycle.reason}};
  DescriptionJson points = DescriptionJson::array();
  for (const SlowCycle::Point& point : cycle.points)
    points.push_back({{"deflection_rad", point.deflection_rad},
                      {"torque_Nm", point.torque_Nm},
                      {"stiffness_Nm_rad", point.stiffness_Nm_rad},
                      {"loop_width_Nm", point.loop_width_Nm},
                      {"friction_Nm", point.friction_Nm}});
  DescriptionJson held = DescriptionJson::object();
  for (const auto& [channel, value] : cycle.held) held[channel] = value;
  return {{"status", "ok"},
          {"reason", nullptr},
          {"period_s", cycle.period_s},
          {"lowest_rad", cycle.lowest_rad},
          {"highest_rad", cycle.highest_rad},
          {"held", held},
          {"stiffness_Nm_rad", cycle.stiffness_Nm_rad},
          {"loop_width_at_zero_Nm", json_number(cycle.width_at_zero_Nm)},
          {"largest_loop_width_Nm", cycle.largest_width_Nm},
          {"largest_loop_width_at_rad", cycle.largest_width_at_rad},
          {"friction_Nm", cycle.friction_Nm},
          {"points", points}};
}

/// The coefficients with their units, or the parameters as the model file names them.
std::string parameter_text(const ModelFile& model) {
  const ParameterDescription description = description_of(model);
  if (!description.coefficients.empty() && description.coefficients.size() <= kReadable)
    return coefficient_table(description.coefficients);
  std::vector<Leaf> leaves = leaves_of(model);
  std::erase_if(leaves, [&](const Leaf& leaf) {
    return !description.covered.empty() && leaf.name.starts_with(description.covered);
  });
  std::string text;
  for (const std::string& line : description.lines) text += fmt::format("{}\n", line);
  return text + parameter_lines(leaves);
}

std::string zero_line(const EstimatorSettings& settings) {
  if (settings.zeroed_channels.empty()) return {};
  return fmt::format(
      "requires the zero of {}: set_zero(channel, value) before the loop, the mapping's zero: on "
      "files; without it every step is zero_not_set\n",
      fmt::join(settings.zeroed_channels, ", "));
}

std::string family_of(const ModelFile& model) {
  const std::string own(model.parameters.family());
  const std::string& asked = model.card.fitted_as;
  return asked.empty() || asked == own ? own : fmt::format("{} ({})", asked, own);
}

}  // namespace

std::string model_description(const ModelFile& model, const SlowCycle& cycle) {
  const EstimatorSettings& settings = model.settings;
  std::string text =
      fmt::format("{} for {} at {:g} Hz, {} numbers, by torsio {}\n", family_of(model),
                  settings.target, settings.sample_rate_Hz,
                  AnyModel(model.parameters).parameter_count(), model.card.torsio_version);
  if (!model.card.device_serial.empty())
    text += fmt::format("belongs to the device {}\n", model.card.device_serial);
  for (const Source& source : model.card.training_files)
    text += fmt::format("trained on {}{}\n", source.file,
                        source.sha256.empty() ? "" : fmt::format(", sha256 {}", source.sha256));
  text += adaptation_lines(model.card);
  text += score_line(model);
  text += zero_line(settings);
  text += load_lines(model.card);
  text += sensor_line(settings);
  text += mapping_lines(model.card);
  text += fmt::format("\n{}", range_table(settings));
  for (const ChannelDefinition& definition : settings.features.definitions)
    text += fmt::format("{} = {}\n", definition.name, definition.expression);
  return text + "\n" + parameter_text(model) + "\n" + cycle_text(cycle);
}

std::string model_description_json(const ModelFile& model, const SlowCycle& cycle) {
  DescriptionJson document{
      {"family", family_of(model)},
      {"target", model.settings.target},
      {"sample_rate_Hz", model.settings.sample_rate_Hz},
      {"device_serial", model.card.device_serial},
      {"inputs", DescriptionJson::array()},
      {"trained_on", DescriptionJson::array()},
      {"mapping", text_or_null(model.card.mapping)},
      {"load", model.card.load_target.is_used() ? load_target_json(model.card.load_target)
                                                : DescriptionJson()},
      {"target_uncertainty", sensor_json(model.settings)},
      {"options", model.card.options},
      {"held_out", model.card.held_out},
      {"metrics", model.card.metrics},
      {"parameters", DescriptionJson::object()}};
  for (std::size_t j = 0; j < model.settings.features.inputs.size(); ++j)
    document["inputs"].push_back({{"expression", model.settings.features.inputs[j]},
                                  {"lowest", model.settings.ranges.lowest[j]},
                                  {"highest", model.settings.ranges.highest[j]}});
  for (const Source& source : model.card.training_files)
    document["trained_on"].push_back({{"file", source.file}, {"sha256", source.sha256}});
  for (const Leaf& leaf : leaves_of(model)) document["parameters"][leaf.name] = leaf.values;
  document["slow_cycle"] = cycle_json(cycle);
  return json_text(document);
}

}  // namespace torsio
