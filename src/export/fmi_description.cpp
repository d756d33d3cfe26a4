#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "data/names.hpp"
#include "export/fmi_variables.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/units.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

/// Text for an attribute or an element.
std::string fmi_text(std::string_view text) {
  std::string safe;
  for (const char c : escaped(text)) {
    switch (c) {
      case '&': safe += "&amp;"; break;
      case '<': safe += "&lt;"; break;
      case '>': safe += "&gt;"; break;
      case '"': safe += "&quot;"; break;
      default: safe += c;
    }
  }
  return safe;
}

/// A unit of `known_units` in powers of the base units, as attributes of the standard's BaseUnit.
struct FmiUnit {
  std::string_view si_suffix;
  std::string_view powers;
};
constexpr auto kFmiUnits = std::to_array<FmiUnit>({
    {"s", R"(s="1")"},
    {"Hz", R"(s="-1")"},
    {"rad", R"(rad="1")"},
    {"rad_s", R"(s="-1" rad="1")"},
    {"rad_s2", R"(s="-2" rad="1")"},
    {"Nm", R"(kg="1" m="2" s="-2")"},
    {"Nm_s", R"(kg="1" m="2" s="-3")"},
    {"Nm_rad", R"(kg="1" m="2" s="-2" rad="-1")"},
    {"Nms_rad", R"(kg="1" m="2" s="-1" rad="-1")"},
    {"A", R"(A="1")"},
    {"V", R"(kg="1" m="2" s="-3" A="-1")"},
    {"W", R"(kg="1" m="2" s="-3")"},
    {"N", R"(kg="1" m="1" s="-2")"},
    {"m", R"(m="1")"},
    {"m_s", R"(m="1" s="-1")"},
    {"m_s2", R"(m="1" s="-2")"},
    {"kg", R"(kg="1")"},
    {"kg_m2", R"(kg="1" m="2")"},
    {"J", R"(kg="1" m="2" s="-2")"},
    {"Pa", R"(kg="1" m="-1" s="-2")"},
    {"K", R"(K="1")"},
});

enum class FmiRole : std::uint8_t { time, input, zero, value, std_dev, fault };

struct FmiVariable {
  std::string name;
  FmiRole role = FmiRole::input;
  std::string channel = {};  ///< whose unit it has
  std::string description = {};
};

std::vector<FmiVariable> variables_of(const FmiVariables& variables) {
  std::vector<FmiVariable> all{
      {"time", FmiRole::time, "time_s", "time at the end of the last communication step"}};
  for (const std::string& channel : variables.inputs)
    all.push_back({channel, FmiRole::input, channel,
                   "measured at the beginning of a step; NaN: not measured"});
  for (const std::string& channel : variables.zeros)
    all.push_back({"zero_" + channel, FmiRole::zero, channel,
                   "what " + channel + " is where the training had its zero"});
  all.push_back({variables.target, FmiRole::value, variables.target,
                 "estimate of the last tick, always finite; the model's only without a fault"});
  all.push_back({"std_dev", FmiRole::std_dev, variables.target,
                 "error bar of the estimate; NaN where there is no evidence"});
  all.push_back({"fault", FmiRole::fault, {}, "why the estimate must not be used as the model's"});
  return all;
}

/// ` unit="Nm"`; empty for a number without a unit.
std::string unit_attribute(const std::string& channel) {
  const std::string label = unit_label(channel);
  return label.empty() ? "" : fmt::format(" unit=\"{}\"", label);
}

std::string units_text(const std::vector<FmiVariable>& variables) {
  std::vector<std::string_view> used;
  std::string text;
  for (const FmiVariable& variable : variables) {
    const auto parts = split_channel_name(variable.channel);
    if (!parts) continue;
    const auto* const unit =
        std::ranges::find(kFmiUnits, parts->unit->si_suffix, &FmiUnit::si_suffix);
    if (unit == kFmiUnits.end() || std::ranges::find(used, unit->si_suffix) != used.end()) continue;
    used.push_back(unit->si_suffix);
    text += fmt::format("    <Unit name=\"{}\"><BaseUnit {}/></Unit>\n",
                        unit_label(variable.channel), unit->powers);
  }
  return "  <UnitDefinitions>\n" + text + "  </UnitDefinitions>\n";
}

std::string fault_items() {
  std::string text;
  for (std::size_t i = 0; i < kFaultCount; ++i)
    text += fmt::format("      <Item name=\"{}\" value=\"{}\"/>\n", name(static_cast<Fault>(i)), i);
  return text;
}

/// causality, variability and initial, which both versions call the same.
std::string_view role_attributes(FmiRole role) {
  switch (role) {
    case FmiRole::time: return R"(causality="independent" variability="continuous")";
    case FmiRole::input: return R"(causality="input" variability="continuous")";
    case FmiRole::zero: return R"(causality="parameter" variability="tunable" initial="exact")";
    default: return R"(causality="output" variability="discrete" initial="calculated")";
  }
}

std::string variable_text(const FmiVariable& variable, std::size_t reference, bool is_two) {
  const std::string common =
      fmt::format(R"(name="{}" valueReference="{}" {} description="{}")", fmi_text(variable.name),
                  reference, role_attributes(variable.role), fmi_text(variable.description));
  const bool has_start = variable.role == FmiRole::input || variable.role == FmiRole::zero;
  const std::string type =
      variable.role == FmiRole::fault ? "Enumeration" : std::string(is_two ? "Real" : "Float64");
  const std::string own = variable.role == FmiRole::fault ? " declaredType=\"Fault\""
                                                          : unit_attribute(variable.channel) +
                                                                (has_start ? " start=\"0\"" : "");
  return is_two
             ? fmt::format("    <ScalarVariable {}><{}{}/></ScalarVariable>\n", common, type, own)
             : fmt::format("    <{} {}{}/>\n", type, common, own);
}

/// Nothing depends on the inputs of the same instant, so that an importer need not iterate.
std::string structure_text(const FmiVariables& variables, bool is_two) {
  const auto unknowns = [&](const char* element, const char* key, std::size_t shift) {
    std::string text;
    for (std::size_t i = variables.value(); i <= variables.fault(); ++i)
      text += fmt::format("    {}<{} {}=\"{}\" dependencies=\"\"/>\n", is_two ? "  " : "", element,
                          key, i + shift);
    return text;
  };
  // FMI 2 counts variables from 1.
  if (is_two)
    return "    <Outputs>\n" + unknowns("Unknown", "index", 1) + "    </Outputs>\n" +
           "    <InitialUnknowns>\n" + unknowns("Unknown", "index", 1) + "    </InitialUnknowns>\n";
  return unknowns("Output", "valueReference", 0) + unknowns("InitialUnknown", "valueReference", 0);
}

/// "grey_box, bins=33; output torque_Nm, 1000 Hz; from joint.safetensors"
std::string card_line(const ModelFile& model, const std::string& origin) {
  std::string text =
      model.card.fitted_as.empty() ? std::string(model.parameters.family()) : model.card.fitted_as;
  for (const auto& [key, value] : model.card.options) text += fmt::format(", {}={}", key, value);
  text += fmt::format("; output {}, {:g} Hz; from {}", model.settings.target,
                      model.settings.sample_rate_Hz, origin);
  if (!model.card.metrics.empty() && !model.card.held_out.empty()) {
    text += fmt::format("; on {}:", model.card.held_out);
    for (const auto& [key, value] : model.card.metrics)
      text += fmt::format(" {} {:.4g}", key, value);
  }
  if (!model.card.device_serial.empty())
    text += fmt::format("; only for the device {}", model.card.device_serial);
  return text;
}

}  // namespace

std::string fmi_description(const ModelFile& model, const FmuOptions& options,
                            const FmiVariables& variables, const std::string& origin,
                            const std::string& token) {
  const bool is_two = options.version == FmiVersion::two;
  const std::vector<FmiVariable> all = variables_of(variables);
  std::string list;
  for (std::size_t i = 0; i < all.size(); ++i) list += variable_text(all[i], i, is_two);
  const std::string simulation =
      is_two
          ? fmt::format(
                R"(  <CoSimulation modelIdentifier="{0}" canHandleVariableCommunicationStepSize="false" canGetAndSetFMUstate="true" canSerializeFMUstate="true">
    <SourceFiles>
      <File name="{0}.c"/>
      <File name="{0}_fmi.c"/>
    </SourceFiles>
  </CoSimulation>
)",
                options.name)
          : fmt::format(
                R"(  <CoSimulation modelIdentifier="{}" canHandleVariableCommunicationStepSize="false" fixedInternalStepSize="{}" canGetAndSetFMUState="true" canSerializeFMUState="true"/>
)",
                options.name, variables.period_s);
  const std::string types =
      is_two ? fmt::format(
                   "    <SimpleType name=\"Fault\"><Enumeration>\n{}    "
                   "</Enumeration></SimpleType>\n",
                   fault_items())
             : fmt::format("    <EnumerationType name=\"Fault\">\n{}    </EnumerationType>\n",
                           fault_items());
  return fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="{version}" modelName="{name}" {token_name}="{token}" description="{card}" generationTool="torsio {torsio}" variableNamingConvention="flat">
{simulation}{units}  <TypeDefinitions>
{types}  </TypeDefinitions>
  <LogCategories>
    <Category name="logStatusError" description="calls that were refused, and why"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stepSize="{period}"/>
  <ModelVariables>
{variables}  </ModelVariables>
  <ModelStructure>
{structure}  </ModelStructure>
</fmiModelDescription>
)",
                     fmt::arg("version", is_two ? "2.0" : "3.0"), fmt::arg("name", options.name),
                     fmt::arg("token_name", is_two ? "guid" : "instantiationToken"),
                     fmt::arg("token", token), fmt::arg("card", fmi_text(card_line(model, origin))),
                     fmt::arg("torsio", kVersion), fmt::arg("simulation", simulation),
                     fmt::arg("units", units_text(all)), fmt::arg("types", types),
                     fmt::arg("period", variables.period_s), fmt::arg("variables", list),
                     fmt::arg("structure", structure_text(variables, is_two)));
}

std::string fmi_build_description(const FmuOptions& options) {
  return fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="{0}">
    <SourceFileSet language="C99">
      <SourceFile name="{0}.c"/>
      <SourceFile name="{0}_fmi.c"/>
    </SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
)",
                     options.name);
}

std::string fmi_documentation(const ModelFile& model, const FmuOptions& options,
                              const FmiVariables& variables, const std::string& origin) {
  std::string rows;
  for (const FmiVariable& variable : variables_of(variables))
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n", fmi_text(variable.name),
                        unit_label(variable.channel), fmi_text(variable.description));
  std::string features;
  for (const std::string& input : model.settings.features.inputs)
    features += fmt::format("<li>{}</li>\n", fmi_text(input));
  for (const ChannelDefinition& each : model.settings.features.definitions)
    features +=
        fmt::format("<li>where {} = {}</li>\n", fmi_text(each.name), fmi_text(each.expression));
  return fmt::format(R"(<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{name}</title></head>
<body>
<h1>{name}</h1>
<p>Written by torsio {torsio}: {card}.</p>
<p>Features of the model:</p>
<ul>
{features}</ul>
<table>
<tr><th>variable</th><th>unit</th><th>meaning</th></tr>
{rows}</table>
<ul>
<li>A communication step is a whole number of periods of {period} s, one tick each, with the inputs held. Other steps are
errors.</li>
<li>The outputs after a step are those of its last tick, computed from the inputs that were set before the step.</li>
<li>A fault is a value, not an error of FMI. 0: the estimate may be used. Before the first step it is warming_up.</li>
<li>Compile sources/*.c as C99 without -ffast-math. -DFMI{f}_FUNCTION_PREFIX={name}_ prefixes the functions.</li>
</ul>
</body>
</html>
)",
                     fmt::arg("name", options.name), fmt::arg("torsio", kVersion),
                     fmt::arg("card", fmi_text(card_line(model, origin))),
                     fmt::arg("features", features), fmt::arg("rows", rows),
                     fmt::arg("period", variables.period_s),
                     fmt::arg("f", options.version == FmiVersion::two ? 2 : 3));
}

}  // namespace torsio
