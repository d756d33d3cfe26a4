#include "data/mapping_yaml.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

ChannelRule channel_rule(const std::string& name, const YamlValue& yaml) {
  ChannelRule rule{.name = name, .from = {}, .unit = {}};
  const std::string si_name = si_channel_name(name, yaml.place());
  if (yaml.is_scalar()) {
    rule.from = yaml.text();
    return rule;
  }
  yaml.allow_only({"from", "unit", "sign", "scale", "offset"});
  rule.from = yaml.at("from").text();
  if (const auto unit = yaml.find("unit")) {
    const Unit* const known = find_written_unit(unit->text());
    if (known == nullptr) unit->refuse("a known unit: " + known_unit_list());
    rule.unit = known->suffix;
  }
  if (const auto sign = yaml.find("sign")) {
    rule.sign = sign->number();
    if (std::abs(rule.sign) != 1.0) sign->refuse("1 or -1", "Use scale for other factors.");
  }
  if (const auto scale = yaml.find("scale")) {
    rule.scale = scale->factor();
    if (rule.scale == 0.0) scale->refuse("a number other than 0");
  }
  if (const auto offset = yaml.find("offset"))
    rule.offset = offset->number(split_channel_name(si_name)->unit->suffix);
  return rule;
}

ClockRule clock_rule(const YamlValue& yaml) {
  yaml.allow_only({"rebuild", "max_stray_steps", "resample"});
  ClockRule rule;
  if (const auto rebuild = yaml.find("rebuild")) rule.rebuild = rebuild->boolean();
  if (const auto steps = yaml.find("max_stray_steps"))
    rule.max_stray_steps = steps->positive_number("1");
  if (const auto rate = yaml.find("resample")) rule.resample_Hz = rate->positive_number("Hz");
  if (rule.rebuild && rule.resample_Hz > 0.0)
    yaml.refuse("either rebuild or resample",
                "rebuild assumes even samples with coarse stamps; resample uses uneven stamps as "
                "they are.");
  return rule;
}

ChannelDefinition definition(const std::string& name, const YamlValue& expression) {
  const std::string si_name = si_channel_name(name, expression.place());
  if (si_name != name)
    throw Error({.place = expression.place(),
                 .expected = "the SI name " + si_name + ", for expressions compute in SI",
                 .found = "'" + printable(name) + "'"});
  return {.name = name, .expression = expression.text()};
}

std::vector<double> numbers(const YamlValue& yaml) {
  std::vector<double> all;
  for (const YamlValue& item : yaml.items()) all.push_back(item.number());
  return all;
}

}  // namespace

std::string si_channel_name(const std::string& name, const std::string& place) {
  if (const auto parts = split_channel_name(name)) return parts->si();
  throw Error({.place = place,
               .expected = "a channel name that ends in a unit, such as torque_Nm",
               .found = "'" + printable(name) + "'",
               .advice = "Known units: " + known_unit_list()});
}

std::vector<ZeroRule> zeros_from(const YamlValue& yaml) {
  std::vector<ZeroRule> rules;
  for (const YamlValue& item : yaml.items()) {
    item.allow_only({"channel", "first", "mid_range"});
    ZeroRule rule;
    const YamlValue channel = item.at("channel");
    rule.channel = si_channel_name(channel.text(), channel.place());
    if (const auto first = item.find("first")) rule.first_s = first->positive_number("s");
    if (const auto middle = item.find("mid_range")) rule.mid_range = middle->boolean();
    if (rule.mid_range == (rule.first_s > 0.0))
      item.refuse("either 'first: 0.1s' or 'mid_range: true'");
    rules.push_back(std::move(rule));
  }
  return rules;
}

Mapping mapping_from(const YamlValue& yaml) {
  if (yaml.find("files"))
    throw Error({.place = yaml.place(),
                 .expected = "a mapping",
                 .found = "a manifest (it has files:)",
                 .advice = "Give a manifest in the place of a recording, without --mapping."});
  yaml.allow_only({"channels", "derive", "drop", "split_by", "keep", "clock", "rate", "zero",
                   "hold", "latency", "computed_from"});
  Mapping mapping;
  mapping.file = yaml.file();
  if (const auto channels = yaml.find("channels"))
    for (const auto& [name, rule] : channels->entries())
      mapping.channels.push_back(channel_rule(name, rule));
  if (const auto derive = yaml.find("derive"))
    for (const auto& [name, expression] : derive->entries())
      mapping.derive.push_back(definition(name, expression));
  if (const auto drop = yaml.find("drop")) mapping.drop = drop->texts();
  if (const auto split = yaml.find("split_by")) mapping.split_by = split->text();
  if (const auto keep = yaml.find("keep")) {
    mapping.keep = numbers(*keep);
    if (mapping.split_by.empty()) keep->refuse("split_by: COLUMN beside keep");
  }
  if (const auto clock = yaml.find("clock")) mapping.clock = clock_rule(*clock);
  if (const auto rate = yaml.find("rate")) mapping.rate_Hz = rate->positive_number("Hz");
  if (const auto zero = yaml.find("zero")) mapping.zero = zeros_from(*zero);
  if (const auto hold = yaml.find("hold"))
    for (const YamlValue& name : hold->items())
      mapping.hold.push_back(si_channel_name(name.text(), name.place()));
  if (const auto latency = yaml.find("latency"))
    for (const auto& [name, value] : latency->entries())
      mapping.latency.push_back({.channel = si_channel_name(name, value.place()),
                                 .latency_s = value.positive_number("s")});
  if (const auto computed = yaml.find("computed_from"))
    for (const auto& [name, from] : computed->entries())
      for (const YamlValue& channel : from.items())
        mapping.computed_from[si_channel_name(name, from.place())].push_back(
            si_channel_name(channel.text(), channel.place()));
  return mapping;
}

Mapping read_mapping(const std::string& path, const Progress& progress) {
  return mapping_from(YamlValue::read(path, progress));
}

Mapping parse_mapping(std::string_view text, const std::string& name) {
  return mapping_from(YamlValue::parse(text, name));
}

}  // namespace torsio
