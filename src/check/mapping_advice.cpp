#include "check/mapping_advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/mapping/column_advice.hpp"
#include "data/mapping/columns.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

std::optional<ChannelRule> rule_of(const Recording& recording, const std::string& name) {
  if (recording.mapping.empty()) return std::nullopt;
  for (const ChannelRule& rule : parse_mapping(recording.mapping, recording.name()).channels)
    if (const auto parts = split_channel_name(rule.name); parts && parts->si() == name) return rule;
  return std::nullopt;
}

const ColumnOfChannel* column_of(const Recording& recording, std::string_view name) {
  const auto at = std::ranges::find(recording.columns, name, &ColumnOfChannel::channel);
  return at == recording.columns.end() ? nullptr : &*at;
}

std::optional<double> scale_of_column(const Recording& recording, const std::string& name) {
  const ColumnOfChannel* const column = column_of(recording, name);
  if (const auto rule = rule_of(recording, name)) {
    const Unit* const unit = column != nullptr ? find_unit(column->unit) : nullptr;
    const auto factor =
        column_factor(*rule, {.name = rule->from,
                              .values = {},
                              .unit = unit != nullptr ? unit->suffix : std::string_view()});
    if (factor) return std::abs(*factor);
  }
  const Unit* const unit = column != nullptr ? find_unit(column->unit) : nullptr;
  return unit != nullptr ? std::optional(unit->scale) : std::nullopt;
}

std::string rule_advice(const Recording& recording, const std::string& name,
                        std::string_view entries) {
  if (const auto rule = rule_of(recording, name))
    return fmt::format("Mapping: add {} to the rule of {}, after its from: {}.", entries,
                       rule->name, yaml_name(rule->from));
  if (const ColumnOfChannel* const column = column_of(recording, name))
    return fmt::format("Mapping:  channels: {{{}: {{from: {}, {}}}}}", name,
                       yaml_name(column->column), entries);
  return fmt::format("Mapping:  channels: {{{0}: {{from: ..., {1}}}}}  with the column of {0}",
                     name, entries);
}

}  // namespace torsio
