#include "data/mapping/columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "data/log_table.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/mapping/columns_without_unit.hpp"
#include "data/mapping/number_coding.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// The name without its unit, or the whole name if it has none (a mapping may specify the unit).
std::string_view quantity_of(std::string_view column_name) {
  const auto parts = split_channel_name(column_name);
  return parts ? parts->quantity : column_name;
}

/// A table whose columns are used up, except for those that are read again.
class UsedTable {
 public:
  UsedTable(LogTable& table, const Mapping& mapping) : table_(table) {
    std::set<const LogColumn*> met;
    for (const ChannelRule& rule : mapping.channels)
      if (const LogColumn* column = table.find(rule.from);
          column != nullptr && !met.insert(column).second)
        read_again(*column);
  }

  [[nodiscard]] LogTable& table() const noexcept { return table_; }
  void read_again(const LogColumn& column) { read_again_.insert(&column); }

  /// The column as it is, for the last time if it is not read again.
  [[nodiscard]] std::vector<double> taken(LogColumn& column) const {
    return read_again_.contains(&column) ? column.values : std::move(column.values);
  }
  /// scale * values + offset. @throws Error where that is too large for a number.
  [[nodiscard]] std::vector<double> converted(const LogColumn& column, std::vector<double> values,
                                              double scale, double offset) const {
    if (scale == 1.0 && offset == 0.0) return values;  // keeps even the sign of a zero
    for (std::size_t row = 0; row < values.size(); ++row) {
      const double raw = std::exchange(values[row], scale * values[row] + offset);
      if (std::isinf(values[row]))
        throw Error({.place = table_.place(row, column),
                     .problem = "too large after its conversion to SI",
                     .expected = "a finite number",
                     .found = fmt::format("{:g} * {:g} + {:g}", scale, raw, offset),
                     .advice = "Check scale:, unit: and offset: of the mapping."});
    }
    return values;
  }

 private:
  LogTable& table_;
  std::set<const LogColumn*> read_again_;
};

/// Texts of dates are in seconds, whatever the names.
const Unit* unit_of_source(const ChannelRule& rule, const LogColumn& column,
                           const Unit* unit_of_channel) {
  if (column.time != TimeKind::none) return find_unit("s");
  if (!rule.unit.empty()) return find_unit(rule.unit);
  if (!column.unit.empty()) return find_unit(column.unit);
  const auto from = split_channel_name(rule.from);
  return from ? from->unit : unit_of_channel;
}

/// From SI to SI.
double factor_of(const ChannelRule& rule, const Unit& unit_of_channel) {
  return rule.sign * rule.scale *
         gear_scale(unit_of_channel.si_suffix, rule.gear_ratio).value_or(1.0);
}

std::vector<double> decoded(std::vector<double> values, const ChannelRule& rule) {
  if (rule.sign_bit > 0.0) decode_sign_bit(values, rule.sign_bit);
  if (rule.modulus > 0.0) decode_modulus(values, rule.modulus);
  if (rule.unwrap > 0.0) unwrap(values, rule.unwrap);
  return values;
}

TableChannel channel_from_rule(const ChannelRule& rule, const UsedTable& used,
                               const std::string& mapping_file) {
  const std::string place = mapping_file + ": channels." + rule.name;
  LogColumn& column = column_named(used.table(), rule.from, place);
  const auto name = split_channel_name(rule.name);
  if (!name) throw Error({.place = place, .problem = "the name has no unit"});
  const Unit* unit = unit_of_source(rule, column, name->unit);
  if (unit == nullptr) throw Error({.place = place, .problem = "unknown unit '" + rule.unit + "'"});
  const double scale = factor_of(rule, *name->unit);
  if (rule.unit.empty() && !column.unknown_unit.empty() && !split_channel_name(rule.from))
    used.table().notes.push_back(fmt::format(
        "the row of units has '{}' for '{}', which is read as {}: state its unit in the mapping",
        printable(column.unknown_unit), printable(rule.from), unit->suffix));
  if (unit->si_suffix != name->unit->si_suffix && rule.scale == 1.0)
    throw Error({.place = place,
                 .expected = fmt::format("a column in a unit of {}", name->unit->si_suffix),
                 .found = fmt::format("'{}' in {}", rule.from, unit->suffix),
                 .advice = fmt::format("Specify the column's unit ('unit:'), or how {} become {} "
                                       "('scale:').",
                                       unit->si_suffix, name->unit->si_suffix)});
  return {.channel = {.name = name->si(),
                      .values =
                          used.converted(column, decoded(used.taken(column), rule),
                                         scale * unit->scale, scale * unit->offset + rule.offset)},
          .column = &column};
}

/// @param in_name the unit in the full name, which is that in brackets only if there is no other
void refuse_conflict(const LogTable& table, const LogColumn& column, const Unit& in_name) {
  const auto in_brackets = unit_in_brackets(column.name);
  const Unit& unit = in_brackets ? *in_brackets->unit : in_name;
  if (column.unit.empty() || column.unit == unit.suffix) return;
  throw Error({.place = table.header_place(column),
               .problem = fmt::format("its name ends in {}, but the row of units has {}",
                                      unit.suffix, column.unit),
               .advice = fmt::format("Specify which is right in a mapping, for example  channels: "
                                     "{{{}: {{from: {}, unit: {}}}}}",
                                     column.full_name(), yaml_name(column.name), column.unit)});
}

/// @param column has a unit
TableChannel channel_from_column(LogColumn& column, const UsedTable& used) {
  const std::string full_name = column.full_name();
  const auto name = split_channel_name(full_name);
  refuse_conflict(used.table(), column, *name->unit);
  const bool is_time = column.time != TimeKind::none;
  return {.channel = {.name = name->si(),
                      .values = used.converted(column, used.taken(column),
                                               is_time ? 1.0 : name->unit->scale,
                                               is_time ? 0.0 : name->unit->offset)},
          .column = &column};
}

/// Removes the columns that the mapping drops. One that is missing may be in other logs of the mapping; a
/// name that resembles that of a column is noted.
void drop_columns(LogTable& table, const Mapping& mapping) {
  const std::vector<std::string> names = table.column_names();
  for (const std::string& name : mapping.drop) {
    if (name.empty() ||
        std::ranges::any_of(names, [&](const auto& column) { return is_matched(column, name); }))
      continue;
    if (const std::string nearest = did_you_mean(name, names); !nearest.empty())
      table.notes.push_back(
          fmt::format("there is no column '{}' to drop. {}", printable(name), nearest));
  }
  std::erase_if(table.columns, [&](const LogColumn& column) {
    if (!is_matched_by_any(column.name, mapping.drop)) return false;
    table.other_columns.push_back(column.name);
    return true;
  });
}

/// The column of dates or times that is the clock of a log without another one.
LogColumn* time_column(LogTable& table, const std::set<const LogColumn*>& consumed) {
  const auto is_time = [&](const LogColumn& column) {
    return column.time != TimeKind::none && column.time != TimeKind::date &&
           !consumed.contains(&column) && !split_channel_name(column.name);
  };
  const auto at = std::ranges::find_if(table.columns, is_time);
  const bool is_only = at != table.columns.end() &&
                       std::find_if(at + 1, table.columns.end(), is_time) == table.columns.end();
  return is_only ? &*at : nullptr;
}

/// The only channel in seconds whose unit is in brackets or in a row of units, whatever its name.
TableChannel* channel_in_seconds(std::vector<TableChannel>& all) {
  const auto is_time = [](const TableChannel& made) {
    const std::string full_name = made.column->full_name();
    const auto name = split_channel_name(full_name);
    return full_name != made.column->name && name && name->unit->si_suffix == "s" &&
           made.channel.name == name->si();
  };
  return std::ranges::count_if(all, is_time) == 1 ? &*std::ranges::find_if(all, is_time) : nullptr;
}

/// A column that marks the new samples of a channel.
struct Mask {
  const LogColumn* column = nullptr;
  std::string_view quantity;  ///< name without unit: the channel's, or its column's
};

/// Columns and rules whose names are those of masks.
std::vector<Mask> masks_of(LogTable& table, const Mapping& mapping) {
  std::vector<Mask> masks;
  for (const ChannelRule& rule : mapping.channels)
    if (const std::string_view quantity = marked_quantity(rule.name); !quantity.empty())
      masks.push_back(
          {&column_named(table, rule.from, mapping.file + ": channels." + rule.name), quantity});
  const auto is_used = [&](const LogColumn& column) {
    return std::ranges::find(mapping.channels, column.name, &ChannelRule::from) !=
           mapping.channels.end();
  };
  for (const LogColumn& column : table.columns)
    if (const std::string_view quantity = marked_quantity(column.name);
        !quantity.empty() && !is_used(column))
      masks.push_back({&column, quantity});
  return masks;
}

/// Whether the mask is one of a channel that this column or this rule makes.
bool is_marked_by(const Mask& mask, std::string_view column, std::string_view channel) {
  return mask.quantity == quantity_of(column) || mask.quantity == quantity_of(channel);
}

std::vector<std::uint8_t> freshness_mask(const LogTable& table, const LogColumn& column) {
  std::vector<std::uint8_t> mask(column.values.size());
  for (std::size_t row = 0; row < mask.size(); ++row) {
    const double value = column.values[row];
    if (value != 0.0 && value != 1.0)
      throw Error({.place = table.place(row, column),
                   .expected = "1 (new sample) or 0 (held)",
                   .found = fmt::format("{}", value)});
    mask[row] = value != 0.0 ? 1 : 0;
  }
  return mask;
}

void refuse_duplicates(const std::vector<TableChannel>& channels, const LogTable& table) {
  std::map<std::string_view, const LogColumn*> seen;
  for (const TableChannel& made : channels) {
    const auto [first, is_new] = seen.emplace(made.channel.name, made.column);
    if (!is_new)
      throw Error(
          {.place = table.header_place(*made.column),
           .problem = fmt::format("duplicate column: in SI it is {}, and so is column {} "
                                  "({})",
                                  made.channel.name, first->second->number, first->second->name),
           .advice = fmt::format("Leave one out in a mapping:  drop: [{}]",
                                 yaml_name(made.column->name))});
  }
}

bool is_clock(const TableChannel& made) {
  return made.channel.name == "t_s" || made.channel.name == "time_s";
}

}  // namespace

std::optional<double> column_factor(const ChannelRule& rule, const LogColumn& column) noexcept {
  const auto name = split_channel_name(rule.name);
  const Unit* const unit = name ? unit_of_source(rule, column, name->unit) : nullptr;
  if (unit == nullptr) return std::nullopt;
  return factor_of(rule, *name->unit) * unit->scale;
}

std::vector<ColumnOfChannel> columns_of_channels(const TableChannels& columns,
                                                 const Mapping& mapping) {
  std::vector<ColumnOfChannel> named;
  const auto add = [&](const TableChannel& made, std::string channel) {
    if (made.column == nullptr) return;
    const auto rule = std::ranges::find_if(mapping.channels, [&](const ChannelRule& each) {
      const auto name = split_channel_name(each.name);
      return each.from == made.column->name && name && name->si() == made.channel.name;
    });
    const std::string full_name = made.column->full_name();
    const auto name = split_channel_name(rule != mapping.channels.end() ? rule->name : full_name);
    const Unit* unit = name ? name->unit : nullptr;
    if (rule != mapping.channels.end()) unit = unit_of_source(*rule, *made.column, unit);
    named.push_back({std::move(channel), made.column->name,
                     unit != nullptr ? std::string(unit->suffix) : std::string()});
  };
  if (columns.clock) add(*columns.clock, "t_s");
  for (const TableChannel& made : columns.channels) add(made, made.channel.name);
  return named;
}

std::string_view marked_quantity(std::string_view name) noexcept {
  constexpr std::string_view kFreshEnding = "_fresh_1";
  return name.ends_with(kFreshEnding) ? name.substr(0, name.size() - kFreshEnding.size())
                                      : std::string_view{};
}

std::optional<double> gear_scale(std::string_view si_unit, double gear_ratio) noexcept {
  if (si_unit == "rad" || si_unit == "rad_s" || si_unit == "rad_s2") return 1.0 / gear_ratio;
  if (si_unit == "Nm" || si_unit == "Nm_s") return gear_ratio;
  return std::nullopt;
}

LogColumn& column_named(LogTable& table, const std::string& name, const std::string& place) {
  const auto at = std::ranges::find(table.columns, name, &LogColumn::name);
  if (at != table.columns.end()) return *at;
  const std::vector<std::string> names = table.column_names();
  std::string advice = did_you_mean(name, names);
  if (!advice.empty()) advice += "\n  ";
  throw Error({.place = place,
               .problem = fmt::format("{} has no column '{}'", table.source.file, name),
               .found = "the columns " + joined(names),
               .advice = advice + advice_on_drafts(table)});
}

TableChannels channels_of_table(LogTable& table, const Mapping& mapping) {
  drop_columns(table, mapping);
  UsedTable used(table, mapping);
  std::vector<Mask> masks = masks_of(table, mapping);
  // Without a channel that it marks, a column of such a name is a channel itself.
  std::erase_if(masks, [&](const Mask& mask) {
    return std::ranges::none_of(table.columns, [&](const LogColumn& column) {
      const auto rule = std::ranges::find(mapping.channels, column.name, &ChannelRule::from);
      return &column != mask.column &&
             is_marked_by(mask, column.name,
                          rule != mapping.channels.end() ? rule->name : column.name);
    });
  });
  std::set<const LogColumn*> consumed;
  for (const Mask& mask : masks) consumed.insert(mask.column);
  if (!mapping.split_by.empty())
    consumed.insert(&column_named(table, mapping.split_by, mapping.file + ": split_by"));
  for (const LogColumn* column : consumed) used.read_again(*column);

  std::vector<TableChannel> all;
  for (const ChannelRule& rule : mapping.channels) {
    if (!marked_quantity(rule.name).empty() &&
        consumed.contains(&column_named(table, rule.from, mapping.file)))
      continue;
    all.push_back(channel_from_rule(rule, used, mapping.file));
    consumed.insert(all.back().column);
  }
  if (mapping.channels.empty() && table.has_units) refuse_columns_without_unit(table, consumed);
  std::vector<std::string> left_out;
  for (LogColumn& column : table.columns) {
    if (consumed.contains(&column)) continue;
    const bool is_left_out = !column.has_unit() && (!mapping.channels.empty() || !table.has_units);
    if (!is_left_out && (column.time == TimeKind::none || column.has_unit()))
      all.push_back(channel_from_column(column, used));
    else if (table.has_units && column.time == TimeKind::none)
      left_out.push_back(column.name);
  }
  if (!left_out.empty()) table.notes.push_back(note_of_left_out(left_out));
  LogColumn* const times = time_column(table, consumed);
  if (times != nullptr && mapping.rate_Hz == 0.0 && std::ranges::none_of(all, is_clock)) {
    all.push_back(
        {.channel = {.name = "t_s", .values = used.converted(*times, used.taken(*times), 1.0, 0.0)},
         .column = times});
    table.notes.push_back(fmt::format("the times in '{}' are the clock", printable(times->name)));
  } else if (times != nullptr && mapping.rate_Hz != 0.0) {
    table.notes.push_back(fmt::format("the times in '{}' are not read: the mapping has a rate",
                                      printable(times->name)));
  }
  if (mapping.rate_Hz == 0.0 && std::ranges::none_of(all, is_clock))
    if (TableChannel* const made = channel_in_seconds(all)) {
      made->channel.name = "t_s";
      table.notes.push_back(
          fmt::format("the times in '{}' are the clock", printable(made->column->name)));
    }
  refuse_duplicates(all, table);
  for (const Mask& mask : masks) {
    const LogColumn* marked = nullptr;
    for (TableChannel& made : all) {
      if (!is_marked_by(mask, made.column->name, made.channel.name)) continue;
      if (marked != nullptr)
        throw Error({.place = table.header_place(*mask.column),
                     .problem = "two columns could be meant",
                     .found = marked->name + " and " + made.column->name});
      marked = made.column;
      made.channel.fresh = freshness_mask(table, *mask.column);
    }
  }
  for (TableChannel& made : all)
    if (made.channel.fresh.empty()) made.channel.fresh = made.column->fresh;

  TableChannels result;
  for (TableChannel& made : all) {
    if (!is_clock(made)) {
      result.channels.push_back(std::move(made));
    } else if (!result.clock) {
      result.clock = std::move(made);
    } else {
      throw Error({.place = table.header_place(*made.column),
                   .problem = "two clocks",
                   .found = result.clock->column->name + " and " + made.column->name,
                   .advice = "Leave one out in a mapping:  drop: [" + made.column->name + "]"});
    }
  }
  if (result.channels.empty())
    throw Error({.place = table.source.file,
                 .problem = "no channels",
                 .expected = table.has_units ? "at least one column beside the clock"
                                             : "a mapping that names the fields to be read",
                 .found = table.has_units ? "" : "the fields " + table.column_list(),
                 .advice = table.has_units ? ""
                                           : "Write a mapping: channels: {joint_angle_rad: FIELD, "
                                             "torque_Nm: FIELD}"});
  return result;
}

}  // namespace torsio
