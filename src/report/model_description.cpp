#include "torsio/report/model_description.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "files/known_families.hpp"
#include "model/common/parameters.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/import/import_network.hpp"
#include "torsio/model/network/network_layers.hpp"
#include "torsio/report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

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

/// The names of a list's fields without their numbers.
std::string outline(const Leaf& leaf) {
  const std::string field = leaf.name.substr(leaf.name.rfind('.') + 1);
  if (field == "activation") return std::string(name(static_cast<Activation>(leaf.values.front())));
  return fmt::format("{} {}", field, leaf.shape);
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
      lines.push_back(fmt::format("{}: {}", element, outline(leaf)));
    } else if (leaf.values.size() <= kReadable) {
      lines.push_back(fmt::format("{} = {:.6g}", leaf.name, fmt::join(leaf.values, ", ")));
    } else {
      lines.push_back(fmt::format("{}: {} numbers", leaf.name, leaf.shape));
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

std::string model_description(const ModelFile& model) {
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
  for (const auto& [option, value] : model.card.options)
    if (option.starts_with("adaptation.")) text += fmt::format("{} {}\n", option, value);
  if (!model.card.metrics.empty()) {
    text += fmt::format("errors on {}:", model.card.held_out);
    for (const auto& [name, value] : model.card.metrics)
      text += fmt::format(" {} {:.4g}", name, value);
    text += "\n";
  }
  text += zero_line(settings);
  text += fmt::format("\n{}", range_table(settings));
  for (const ChannelDefinition& definition : settings.features.definitions)
    text += fmt::format("{} = {}\n", definition.name, definition.expression);
  const ParameterDescription description = description_of(model);
  if (!description.coefficients.empty() && description.coefficients.size() <= kReadable)
    return text + "\n" + coefficient_table(description.coefficients);
  std::vector<Leaf> leaves = leaves_of(model);
  std::erase_if(leaves, [&](const Leaf& leaf) {
    return !description.covered.empty() && leaf.name.starts_with(description.covered);
  });
  text += "\n";
  for (const std::string& line : description.lines) text += line + "\n";
  return text + parameter_lines(leaves);
}

std::string model_description_json(const ModelFile& model) {
  using Json = nlohmann::ordered_json;
  Json document{{"family", family_of(model)},
                {"target", model.settings.target},
                {"sample_rate_Hz", model.settings.sample_rate_Hz},
                {"device_serial", model.card.device_serial},
                {"inputs", Json::array()},
                {"trained_on", Json::array()},
                {"options", model.card.options},
                {"held_out", model.card.held_out},
                {"metrics", model.card.metrics},
                {"parameters", Json::object()}};
  for (std::size_t j = 0; j < model.settings.features.inputs.size(); ++j)
    document["inputs"].push_back({{"expression", model.settings.features.inputs[j]},
                                  {"lowest", model.settings.ranges.lowest[j]},
                                  {"highest", model.settings.ranges.highest[j]}});
  for (const Source& source : model.card.training_files)
    document["trained_on"].push_back({{"file", source.file}, {"sha256", source.sha256}});
  for (const Leaf& leaf : leaves_of(model)) document["parameters"][leaf.name] = leaf.values;
  return json_text(document);
}

}  // namespace torsio
