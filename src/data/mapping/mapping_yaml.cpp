#include "data/mapping/mapping_yaml.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "core/trimmed.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/ready_mappings.hpp"
#include "data/mapping/uncertainty.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Also `[ms]`, which YAML reads as a list.
std::string written_unit(const YamlValue& yaml) {
  if (!yaml.is_list()) return yaml.text();
  const std::vector<std::string> texts = yaml.texts();
  if (texts.size() != 1) yaml.refuse("one unit, such as deg");
  return texts.front();
}

/// A word of a draft that only the user can replace.
void refuse_placeholder(const YamlValue& yaml, std::string_view word, const std::string& advice) {
  if (!yaml.is_scalar()) return;
  const std::string text = yaml.text();
  const std::size_t slash = text.find('/');
  if (trimmed(text) == word ||
      (slash != std::string::npos && trimmed(std::string_view(text).substr(slash + 1)) == word))
    yaml.refuse("a number", advice);
}

ChannelRule channel_rule(const std::string& name, const YamlValue& yaml) {
  ChannelRule rule{.name = name, .from = {}, .unit = {}};
  const std::string si_name = si_channel_name(name, yaml.place());
  if (yaml.is_scalar()) {
    rule.from = yaml.text();
    return rule;
  }
  yaml.allow_only(
      {"from", "unit", "sign", "scale", "offset", "gear_ratio", "sign_bit", "modulus", "unwrap"});
  rule.from = yaml.at("from").text();
  if (const auto unit = yaml.find("unit")) {
    const std::string written = written_unit(*unit);
    const Unit* const known = unit_in_words(written);
    if (known == nullptr)
      unit->refuse("a unit",
                   advice_on_written_unit(written, split_channel_name(si_name)->unit->si_suffix));
    rule.unit = known->suffix;
  }
  if (const auto sign = yaml.find("sign")) {
    rule.sign = sign->number();
    if (std::abs(rule.sign) != 1.0) sign->refuse("1 or -1", "Use scale for other factors.");
  }
  if (const auto scale = yaml.find("scale")) {
    refuse_placeholder(*scale, "COUNTS",
                       "Write the counts of one turn of the encoder in the place of COUNTS, such "
                       "as  scale: 1/4096");
    refuse_placeholder(
        *scale, "FACTOR",
        "Write how much one of the column's numbers is in the unit of unit:, such as "
        " scale: 0.001");
    rule.scale = scale->factor();
    if (rule.scale == 0.0) scale->refuse("a number other than 0");
  }
  if (const auto ratio = yaml.find("gear_ratio")) {
    refuse_placeholder(*ratio, "N",
                       "Write the gear ratio in the place of N, such as  gear_ratio: 80");
    rule.gear_ratio = ratio->factor();
    if (!(rule.gear_ratio > 0.0)) ratio->refuse("a positive number, like 150");
    if (!gear_scale(split_channel_name(si_name)->unit->si_suffix, rule.gear_ratio))
      ratio->refuse("no gear ratio for this unit: angles, their rates and torques have one",
                    "Use scale.");
  }
  int codings = 0;
  for (const auto& [key, number] : {std::pair("sign_bit", &ChannelRule::sign_bit),
                                    {"modulus", &ChannelRule::modulus},
                                    {"unwrap", &ChannelRule::unwrap}})
    if (const auto given = yaml.find(key)) {
      rule.*number = given->factor();
      if (!(rule.*number > 0.0)) given->refuse("a positive number of the column, like 65536");
      if (++codings > 1) yaml.refuse("one of sign_bit, modulus and unwrap");
    }
  if (const auto offset = yaml.find("offset"))
    rule.offset = offset->number(split_channel_name(si_name)->unit->suffix);
  return rule;
}

ClockRule clock_rule(const YamlValue& yaml) {
  yaml.allow_only(
      {"rebuild", "max_stray_steps", "resample", "max_gap", "split_at_gaps", "sort", "format"});
  ClockRule rule;
  if (const auto rebuild = yaml.find("rebuild")) rule.rebuild = rebuild->boolean();
  if (const auto sort = yaml.find("sort")) rule.sort = sort->boolean();
  if (const auto steps = yaml.find("max_stray_steps"))
    rule.max_stray_steps = steps->positive_number("1");
  if (const auto rate = yaml.find("resample")) rule.resample_Hz = rate->positive_number("Hz");
  if (const auto gap = yaml.find("split_at_gaps")) rule.split_at_gaps_s = gap->positive_number("s");
  if (const auto gap = yaml.find("max_gap")) {
    rule.max_gap_s = gap->positive_number("s");
    if (!(rule.resample_Hz > 0.0)) gap->refuse("resample: beside max_gap");
  }
  if (const auto format = yaml.find("format")) {
    rule.format = format->text();
    if (rule.format.find('%') == std::string::npos)
      format->refuse("a format of dates, such as %d/%m/%Y %H:%M:%S");
  }
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

namespace {

/// A joint of a mapping for several, and what its placeholders become.
struct MappedJoint {
  std::string name;
  std::map<std::string, std::string> texts;
};

/// `joints: [elbow, wrist]`, or with further placeholders `joints: {elbow: {motor: m3}, ..}`.
std::vector<MappedJoint> joints_from(const YamlValue& joints) {
  std::vector<MappedJoint> all;
  if (!joints.is_map()) {
    for (const YamlValue& name : joints.items())
      all.push_back({name.text(), {{"joint", name.text()}}});
  } else {
    for (const auto& [name, parts] : joints.entries()) {
      all.push_back({name, {{"joint", name}}});
      for (const auto& [key, text] : parts.entries()) {
        if (key == "joint") text.refuse("another name than 'joint', which is that of the joint");
        all.back().texts[key] = text.text();
      }
      for (const auto& [key, text] : all.front().texts)
        if (!all.back().texts.contains(key)) parts.refuse("the key '" + key + "', as other joints");
    }
  }
  if (all.empty()) joints.refuse("at least one joint");
  return all;
}

std::vector<std::string> names_of(const std::vector<MappedJoint>& joints) {
  std::vector<std::string> names;
  names.reserve(joints.size());
  for (const MappedJoint& joint : joints) names.push_back(joint.name);
  return names;
}

/// Whether a column is named by the joint. Without `joints:` any joint may be meant.
bool has_placeholder(const YamlValue& yaml) {
  const auto channels = yaml.find("channels");
  if (!channels) return false;
  return std::ranges::any_of(channels->entries(), [](const auto& entry) {
    const auto from = entry.second.is_map() ? entry.second.find("from") : entry.second;
    return from && from->is_scalar() && from->text().find("{joint}") != std::string::npos;
  });
}

[[noreturn]] void refuse_joint(const std::string& file, const std::string& joint,
                               const std::vector<std::string>& names) {
  throw UsageError(
      {.place = file,
       .problem = joint.empty() ? "the mapping is one for several joints"
                                : "there is no joint '" + printable(joint) + "'",
       .expected = names.empty() ? "" : "one of the joints " + joined(names),
       .advice = joint.empty() ? "Choose one: --joint NAME" : did_you_mean(joint, names)});
}

/// The file of that name, or else the mapping that comes with torsio.
YamlValue yaml_of(const std::string& path, const Progress& progress) {
  std::error_code absent;
  if (path != "-" && !std::filesystem::exists(path, absent))
    if (const std::string_view text = ready_mapping(path); !text.empty())
      return YamlValue::parse(text, path);
  return YamlValue::read(path, progress);
}

/// The mapping with the names of one joint in the place of the placeholders.
YamlValue of_joint(const YamlValue& yaml, const std::string& joint) {
  const auto listed = yaml.find("joints");
  if (!listed) {
    if (has_placeholder(yaml)) {
      if (joint.empty()) refuse_joint(yaml.file(), joint, {});
      return yaml.replaced({{"joint", joint}});
    }
    if (!joint.empty())
      throw UsageError({.place = yaml.file(),
                        .problem = "the mapping has no joints to choose from",
                        .expected = "joints: and names of columns with {joint}",
                        .advice = "Leave --joint out."});
    return yaml;
  }
  const std::vector<MappedJoint> joints = joints_from(*listed);
  const auto chosen = joint.empty() && joints.size() == 1
                          ? joints.begin()
                          : std::ranges::find(joints, joint, &MappedJoint::name);
  if (chosen == joints.end()) refuse_joint(yaml.file(), joint, names_of(joints));
  return yaml.replaced(chosen->texts);
}

}  // namespace

Mapping mapping_from(const YamlValue& of_joints, const std::string& joint) {
  if (of_joints.find("files"))
    throw Error({.place = of_joints.place(),
                 .expected = "a mapping",
                 .found = "a manifest (it has files:)",
                 .advice = "Give a manifest in the place of a recording, without --mapping."});
  of_joints.allow_only({"joints", "channels", "derive", "drop", "missing", "decimal", "skip_lines",
                        "split_by", "keep", "clock", "rate", "from", "to", "zero", "hold",
                        "latency", "uncertainty", "computed_from"});
  const YamlValue yaml = of_joint(of_joints, joint);
  Mapping mapping;
  mapping.file = yaml.file();
  if (const auto channels = yaml.find("channels"))
    for (const auto& [name, rule] : channels->entries())
      mapping.channels.push_back(channel_rule(name, rule));
  if (const auto derive = yaml.find("derive"))
    for (const auto& [name, expression] : derive->entries())
      mapping.derive.push_back(definition(name, expression));
  if (const auto drop = yaml.find("drop")) mapping.drop = drop->texts_or_empty();
  if (const auto missing = yaml.find("missing")) mapping.missing = missing->texts();
  if (const auto decimal = yaml.find("decimal")) {
    mapping.decimal = decimal->text();
    if (mapping.decimal != "comma" && mapping.decimal != "point")
      decimal->refuse("comma or point", "The other one of the two is then a thousands mark.");
  }
  if (const auto lines = yaml.find("skip_lines")) mapping.skip_lines = lines->count();
  if (const auto split = yaml.find("split_by")) mapping.split_by = split->text();
  if (const auto keep = yaml.find("keep")) {
    mapping.keep = numbers(*keep);
    if (mapping.split_by.empty()) keep->refuse("split_by: COLUMN beside keep");
  }
  if (const auto clock = yaml.find("clock")) mapping.clock = clock_rule(*clock);
  if (const auto rate = yaml.find("rate")) mapping.rate_Hz = rate->positive_number("Hz");
  if (const auto from = yaml.find("from")) mapping.from_s = from->positive_number("s");
  if (const auto to = yaml.find("to")) {
    mapping.to_s = to->positive_number("s");
    if (!(mapping.to_s > mapping.from_s)) to->refuse("a time after from:");
  }
  if (const auto zero = yaml.find("zero")) mapping.zero = zeros_from(*zero);
  if (const auto hold = yaml.find("hold"))
    for (const YamlValue& name : hold->items())
      mapping.hold.push_back(si_channel_name(name.text(), name.place()));
  if (const auto latency = yaml.find("latency"))
    for (const auto& [name, value] : latency->entries())
      mapping.latency.push_back({.channel = si_channel_name(name, value.place()),
                                 .latency_s = value.positive_number("s")});
  if (const auto uncertainty = yaml.find("uncertainty"))
    mapping.uncertainty = uncertainties_from(*uncertainty);
  if (const auto computed = yaml.find("computed_from"))
    for (const auto& [name, from] : computed->entries())
      for (const YamlValue& channel : from.items())
        mapping.computed_from[si_channel_name(name, from.place())].push_back(
            si_channel_name(channel.text(), channel.place()));
  return mapping;
}

Mapping read_mapping(const std::string& path, const Progress& progress, const std::string& joint) {
  return mapping_from(yaml_of(path, progress), joint);
}

Mapping parse_mapping(std::string_view text, const std::string& name, const std::string& joint) {
  return mapping_from(YamlValue::parse(text, name), joint);
}

std::vector<std::string> joints_of_mapping(const std::string& path, const Progress& progress) {
  const YamlValue yaml = yaml_of(path, progress);
  const auto joints = yaml.find("joints");
  return joints ? names_of(joints_from(*joints)) : std::vector<std::string>{};
}

}  // namespace torsio
