#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "data/mapping/uncertainty.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

/// The shortest decimals that read back to the same number.
std::string digits(double value) { return fmt::format("{}", value); }

/// `key: value` of the maps of a mapping; what has its default is left out.
class MappingWriter {
 public:
  MappingWriter() { yaml_ << YAML::BeginMap; }

  void add(const ChannelRule& rule) {
    yaml_ << YAML::Key << rule.name << YAML::Value << YAML::Flow << YAML::BeginMap;
    entry("from", rule.from);
    if (!rule.unit.empty()) entry("unit", rule.unit);
    if (rule.sign != 1.0) entry("sign", digits(rule.sign));
    if (rule.scale != 1.0) entry("scale", digits(rule.scale));
    if (rule.offset != 0.0) entry("offset", digits(rule.offset));
    if (rule.gear_ratio != 1.0) entry("gear_ratio", digits(rule.gear_ratio));
    if (rule.sign_bit != 0.0) entry("sign_bit", digits(rule.sign_bit));
    if (rule.modulus != 0.0) entry("modulus", digits(rule.modulus));
    if (rule.unwrap != 0.0) entry("unwrap", digits(rule.unwrap));
    yaml_ << YAML::EndMap;
  }
  void add(const ChannelDefinition& definition) { entry(definition.name, definition.expression); }
  void add(const LatencyRule& rule) { entry(rule.channel, digits(rule.latency_s)); }
  void add(const UncertaintyRule& rule) {
    yaml_ << YAML::Key << rule.channel << YAML::Value << YAML::Flow << YAML::BeginMap;
    for (const auto& [key, value] : entries_of(rule)) entry(key, value);
    yaml_ << YAML::EndMap;
  }
  void add(const std::pair<const std::string, std::vector<std::string>>& computed) {
    yaml_ << YAML::Key << computed.first << YAML::Value << YAML::Flow << computed.second;
  }
  void add(const ZeroRule& rule) {
    yaml_ << YAML::Flow << YAML::BeginMap;
    entry("channel", rule.channel);
    if (rule.mid_range)
      entry("mid_range", "true");
    else
      entry("first", digits(rule.first_s));
    yaml_ << YAML::EndMap;
  }
  void add(const ClockRule& clock) {
    if (!clock.rebuild && !(clock.resample_Hz > 0.0) && !(clock.split_at_gaps_s > 0.0) &&
        !clock.sort && clock.format.empty())
      return;
    yaml_ << YAML::Key << "clock" << YAML::Value << YAML::Flow << YAML::BeginMap;
    if (clock.rebuild) {
      entry("rebuild", "true");
      entry("max_stray_steps", digits(clock.max_stray_steps));
    }
    if (clock.resample_Hz > 0.0) entry("resample", digits(clock.resample_Hz));
    if (clock.max_gap_s > 0.0) entry("max_gap", digits(clock.max_gap_s));
    if (clock.split_at_gaps_s > 0.0) entry("split_at_gaps", digits(clock.split_at_gaps_s));
    if (clock.sort) entry("sort", "true");
    if (!clock.format.empty()) entry("format", clock.format);
    yaml_ << YAML::EndMap;
  }
  void entry(const std::string& key, const std::string& value) {
    yaml_ << YAML::Key << key << YAML::Value << value;
  }
  template <class All>
  void map(const char* key, const All& all) {
    if (all.empty()) return;
    yaml_ << YAML::Key << key << YAML::Value << YAML::BeginMap;
    for (const auto& each : all) add(each);
    yaml_ << YAML::EndMap;
  }
  void list(const char* key, const std::vector<ZeroRule>& rules) {
    if (rules.empty()) return;
    yaml_ << YAML::Key << key << YAML::Value << YAML::BeginSeq;
    for (const ZeroRule& rule : rules) add(rule);
    yaml_ << YAML::EndSeq;
  }
  void list(const char* key, const std::vector<std::string>& texts) {
    if (!texts.empty()) yaml_ << YAML::Key << key << YAML::Value << YAML::Flow << texts;
  }

  [[nodiscard]] std::string text() {
    yaml_ << YAML::EndMap;
    const std::string text = yaml_.c_str();
    return text == "{}" ? std::string() : text + "\n";
  }

 private:
  YAML::Emitter yaml_;
};

}  // namespace

std::string mapping_text(const Mapping& mapping) {
  MappingWriter writer;
  writer.map("channels", mapping.channels);
  writer.map("derive", mapping.derive);
  writer.list("drop", mapping.drop);
  writer.list("missing", mapping.missing);
  if (!mapping.decimal.empty()) writer.entry("decimal", mapping.decimal);
  if (mapping.skip_lines > 0) writer.entry("skip_lines", fmt::format("{}", mapping.skip_lines));
  if (!mapping.split_by.empty()) writer.entry("split_by", mapping.split_by);
  writer.add(mapping.clock);
  if (mapping.rate_Hz > 0.0) writer.entry("rate", digits(mapping.rate_Hz));
  writer.list("zero", mapping.zero);
  writer.list("hold", mapping.hold);
  writer.map("latency", mapping.latency);
  writer.map("uncertainty", mapping.uncertainty);
  writer.map("computed_from", mapping.computed_from);
  return writer.text();
}

}  // namespace torsio
