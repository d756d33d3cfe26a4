#include <fmt/format.h>

#include <algorithm>

#include "check/draft/mapping_draft.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A text that stays in one line of comment.
std::string comment(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + escaped(part);
  return text;
}

std::string certainty_and_reasons(const ColumnGuess& guess) {
  const std::string reasons = comment(guess.reasons);
  return fmt::format("{}{}{}", name(guess.certainty), reasons.empty() ? "" : ": ", reasons);
}

std::string indented(std::string_view text, std::string_view before) {
  std::string lines(before);
  for (const char c : text) {
    lines += c;
    if (c == '\n') lines += before;
  }
  return lines + '\n';
}

/// Columns that no rule names.
std::string others_text(const MappingDraft& draft) {
  constexpr std::size_t kMaxNamed = 40;
  std::vector<std::string> as_named;
  std::vector<std::string> not_read = draft.not_read;
  for (const ColumnGuess& guess : draft.columns) {
    if (!guess.channel.empty()) continue;
    (guess.summary.unit.empty() ? not_read : as_named).push_back(escaped(guess.summary.name));
  }
  std::string text;
  if (!as_named.empty())
    text += "# Channels by their own name and unit: " + listed(as_named, kMaxNamed) + "\n";
  if (!not_read.empty()) text += "# Not read: " + listed(not_read, kMaxNamed) + "\n";
  return text;
}

}  // namespace

std::string ColumnGuess::rule() const {
  std::string rule = fmt::format("{}: {{from: {}", channel, yaml_name(summary.name));
  const bool is_unknown = unit.empty() && summary.unit_origin != UnitOrigin::dates;
  if (is_unknown && scale.empty()) rule += ", unit: UNIT";
  if (is_unknown && !scale.empty()) rule += ", " + scale;
  if (!unit.empty() && summary.unit_origin != UnitOrigin::dates)
    rule += fmt::format(", unit: {}", unit == "1" ? "\"1\"" : unit);
  if (sign < 0.0) rule += ", sign: -1";
  if (needs_ratio && gear_ratio == 1.0) rule += ", gear_ratio: N";
  if (gear_ratio != 1.0) rule += fmt::format(", gear_ratio: {:.6g}", gear_ratio);
  if (unwrap > 0.0) rule += fmt::format(", unwrap: {:.0f}", unwrap);
  return rule + "}";
}

std::string MappingDraft::yaml() const {
  std::string text = fmt::format(
      "# Draft by torsio map of {}: each line states how sure it is and why. Correct it, then\n"
      "#   torsio check {} --mapping THIS_FILE\n",
      escaped(file), escaped(file));
  for (const std::string& remark : remarks) text += "# Missing: " + escaped(remark) + "\n";
  if (!refusal.empty()) text += indented("A recording is not read with it yet: " + refusal, "# ");
  const bool has_rules = std::ranges::any_of(columns, &ColumnGuess::is_written);
  text += has_rules ? "channels:\n" : "# channels:\n";
  for (const ColumnGuess& guess : columns) {
    if (guess.channel.empty()) continue;
    if (guess.is_written())
      text += fmt::format("  {}  # {}\n", guess.rule(), certainty_and_reasons(guess));
    else
      text += fmt::format("  # {}  # not shown by the data: {}; {}\n", guess.rule(),
                          escaped(guess.missing), certainty_and_reasons(guess));
  }
  for (const ColumnGuess& guess : columns)
    if (guess.channel.empty() && !guess.missing.empty())
      text += fmt::format("  # '{}': {}\n", escaped(guess.summary.name), escaped(guess.missing));
  std::vector<std::string> held;
  for (const ColumnGuess& guess : columns)
    if (guess.is_written() && guess.holds) held.push_back(guess.channel);
  if (!held.empty()) text += fmt::format("hold: [{}]\n", joined(held));
  const ColumnGuess* const torque = of("torque_Nm");
  if (torque != nullptr && torque->is_written())
    text +=
        "# uncertainty: {torque_Nm: {class: CLASS, range: RANGE}}  # of the load cell, as 0.2% and "
        "100Nm: then part of the error bars\n";
  if (!clock.empty()) text += fmt::format("clock: {}  # {}\n", clock, clock_reason);
  std::vector<std::string> drop;
  for (const std::string& column : dropped) drop.push_back(yaml_name(column));
  if (!drop.empty()) text += fmt::format("drop: [{}]\n", joined(drop));
  return text + others_text(*this);
}

}  // namespace torsio
