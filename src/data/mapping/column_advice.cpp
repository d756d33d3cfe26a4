#include "data/mapping/column_advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "core/lower.hpp"
#include "core/trimmed.hpp"
#include "data/mapping/unit_words.hpp"
#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

struct Word {
  std::string_view word;
  std::string_view meaning;
};

/// Quantities and the SI unit that they are kept in.
constexpr auto kQuantities = std::to_array<Word>({
    {"timestamp", "s"},
    {"time", "s"},
    {"stamp", "s"},
    {"torque", "Nm"},
    {"moment", "Nm"},
    {"speed", "rad_s"},
    {"velocity", "rad_s"},
    {"rate", "rad_s"},
    {"angle", "rad"},
    {"position", "rad"},
    {"deflection", "rad"},
    {"current", "A"},
    {"voltage", "V"},
    {"force", "N"},
    {"temperature", "K"},
    {"power", "W"},
});

/// The known unit that is meant, or nothing.
std::string_view unit_meant(std::string_view text) {
  if (const Unit* unit = find_unit(text)) return unit->suffix;
  return is_gradian_or_degree(text) ? std::string_view() : unit_spelled(text);
}

/// The SI unit of what the name speaks of, or nothing.
std::string_view unit_of_quantity(std::string_view name) {
  const std::string spoken = lower(name);
  for (const Word& quantity : kQuantities)
    if (spoken.find(quantity.word) != std::string::npos) return quantity.meaning;
  return {};
}

/// Letters, digits and underscores, as in a channel's name.
std::string channel_like(std::string_view text) {
  std::string name;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name.empty() ? "channel" : name;
}

/// "torque_Nm: {from: torque, unit: Nm}"
std::string rule_line(std::string_view quantity, std::string_view unit, std::string_view column,
                      std::string_view rest) {
  const Unit* const known = find_unit(unit);
  const std::string_view si = known != nullptr ? known->si_suffix : unit;
  const bool is_clock = si == "s";
  return fmt::format("{}_{}: {{from: {}, {}}}", is_clock ? "t" : channel_like(quantity), si,
                     yaml_name(column), rest);
}

/// "Torque [Nm]", "Winkel (deg)", "Winkel °": the name and the unit in brackets at its end, or a sign of degrees there.
std::pair<std::string_view, std::string_view> without_brackets(std::string_view name) {
  for (const std::string_view sign : {"\xc2\xb0", "\xc2\xb0/s"})
    if (name.size() > sign.size() && name.ends_with(sign)) {
      name.remove_suffix(sign.size());
      return {trimmed(name), sign == "\xc2\xb0" ? "deg" : "deg/s"};
    }
  if (name.empty() || (name.back() != ']' && name.back() != ')')) return {name, {}};
  const auto open = name.find_last_of(name.back() == ']' ? '[' : '(');
  if (open == std::string_view::npos || open == 0) return {name, {}};
  return {trimmed(name.substr(0, open)), name.substr(open + 1, name.size() - open - 2)};
}

}  // namespace

std::string yaml_name(std::string_view text) {
  const bool is_plain =
      !text.empty() && std::isdigit(static_cast<unsigned char>(text.front())) == 0 &&
      std::ranges::all_of(text, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  return is_plain ? std::string(text) : yaml_quoted(escaped(text));
}

std::optional<NameInBrackets> unit_in_brackets(std::string_view name) {
  const auto [quantity, written] = without_brackets(name);
  if (written.empty() || std::isdigit(static_cast<unsigned char>(written.front())) != 0)
    return std::nullopt;
  const Unit* const unit = written == "-" ? find_unit("1") : unit_in_words(written);
  if (unit == nullptr) return std::nullopt;
  NameInBrackets split{.quantity = std::string(quantity), .unit = unit};
  std::ranges::replace(split.quantity, ' ', '_');
  return split;
}

bool is_like_clock(std::string_view column_name) { return unit_of_quantity(column_name) == "s"; }

namespace {

/// What a column without a known unit may be: the sentence before its line of a mapping, and that line.
struct Proposal {
  std::string lead;
  std::string line;
};

/// Name and unit of a column, where the unit is written in brackets or after the last underscore.
std::pair<std::string_view, std::string_view> name_and_unit(std::string_view column) {
  const auto [quantity, unit] = without_brackets(column);
  const auto ending = column.rfind('_');
  if (!unit.empty() || ending == std::string_view::npos || ending == 0 ||
      ending + 1 >= column.size() || !unit_of_quantity(column.substr(ending + 1)).empty())
    return {quantity, unit};
  return {column.substr(0, ending), column.substr(ending + 1)};
}

Proposal proposal_for(std::string_view column) {
  const auto [quantity, unit] = name_and_unit(column);
  if (is_gradian_or_degree(unit))
    return {"If these are degrees and not gradians (unit: rev, scale: 1/400), write in a mapping",
            rule_line(quantity, "rad", column, "unit: deg")};
  if (is_count(unit))
    return {fmt::format("{} have no size of their own; with COUNTS of them in a revolution, write "
                        "in a mapping",
                        unit),
            rule_line(quantity, "rad", column, "unit: rev, scale: 1/COUNTS")};
  if (const std::string_view meant = unit_meant(unit); !meant.empty())
    return {fmt::format("If that is {}, write in a mapping", meant),
            rule_line(quantity, meant, column, fmt::format("unit: {}", meant))};
  const std::string_view si = unit_of_quantity(quantity);
  if (si.empty())
    return {"Rename the column to NAME_UNIT, or write in a mapping",
            fmt::format("NAME_UNIT: {{from: {}, unit: UNIT}}", yaml_name(column))};
  if (unit.empty())
    return {fmt::format("Rename the column, or specify its unit in a mapping; if it is {}:", si),
            rule_line(quantity, si, column, fmt::format("unit: {}", si))};
  return {fmt::format("Specify in a mapping how many {} one {} is:", si, unit),
          rule_line(quantity, si, column, fmt::format("unit: {}, scale: FACTOR", si))};
}

}  // namespace

std::string mapping_entry(std::string_view column) { return proposal_for(column).line; }

std::string advice_without_unit(std::string_view column) {
  const Proposal proposal = proposal_for(column);
  return fmt::format("{}  channels: {{{}}}  or leave it out:  drop: [{}]", proposal.lead,
                     proposal.line, yaml_name(column));
}

std::string advice_on_written_unit(std::string_view written, std::string_view si_unit) {
  const std::string_view text = without_frame(written);
  if (is_count(text))
    return si_unit == "rad"
               ? "Counts have no size of their own: with COUNTS of them in a revolution, write  "
                 "unit: rev, scale: 1/COUNTS"
               : fmt::format(
                     "Counts have no size of their own: write  unit: {}, scale: FACTOR  "
                     "with the {} of one count",
                     si_unit, si_unit == "1" ? "value" : si_unit);
  if (is_gradian_or_degree(text) || is_gradian(text)) return std::string(kAdviceOnGradians);
  std::vector<std::string> fitting;
  std::string same;  // a proposal with another prefix would be another size: 'MNm' is not 'mNm'
  for (const Unit& unit : known_units()) {
    if (unit.si_suffix != si_unit) continue;
    fitting.emplace_back(unit.suffix);
    if (lower(text) == lower(unit.suffix) && (text.front() == unit.suffix.front()))
      same = unit.suffix;
  }
  if (const std::string_view spelled = unit_spelled(text); !spelled.empty()) same = spelled;
  return (same.empty() ? "" : fmt::format("Did you mean '{}'? ", same)) +
         fmt::format(
             "Units of {0}: {1}. Another unit is read as  unit: {0}, scale: FACTOR  with the {0} "
             "of one of it.\n  Known units: {2}",
             si_unit, joined(fitting), known_unit_list());
}

std::string note_on_unknown_unit(std::string_view written) {
  if (is_count(written))
    return "counts have no size of their own; a mapping states it (unit: rev, scale: 1/COUNTS)";
  if (is_gradian_or_degree(written) || is_gradian(written))
    return fmt::format("not read. {}", kAdviceOnGradians);
  return "not a unit that torsio reads; a mapping states it (unit: ..)";
}

}  // namespace torsio
