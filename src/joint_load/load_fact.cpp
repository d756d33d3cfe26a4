#include "joint_load/load_fact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <vector>

#include "core/quantity.hpp"
#include "core/trimmed.hpp"
#include "data/channel_names.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Whether the text begins as a number does, and is not a name.
bool begins_as_number(std::string_view text) {
  const char first = text.empty() ? '\0' : text.front();
  return std::isdigit(static_cast<unsigned char>(first)) != 0 || first == '-' || first == '+' ||
         first == '.';
}

}  // namespace

LoadFact load_fact(const YamlValue& value, std::string_view si_unit) {
  const std::string text = value.text();
  if (begins_as_number(trimmed(text)))
    return {.value = si_unit == "1" ? value.number()
                                    : signed_quantity_with_unit(text, si_unit, value.place())};
  const auto name = split_channel_name(trimmed(text));
  if (!name || name->unit->si_suffix != si_unit)
    value.refuse(fmt::format(
        "a number with its unit, a multiple of {0}, or the name of a condition of the recordings "
        "that ends in _{0}",
        si_unit));
  return {.condition = name->si()};
}

double fact_in(const LoadFact& fact, const Recording& recording, std::string_view file,
               std::string_view name) {
  if (fact.condition.empty()) return fact.value;
  if (!recording.has(fact.condition))
    throw Error({.place = recording.name(),
                 .expected = fmt::format("the condition {}, which {} names as {}", fact.condition,
                                         file, name),
                 .found = "the channels " + joined(channel_names(recording.channels())),
                 .advice = fmt::format(
                     "State it in the manifest, 'conditions: {{{}: ..}}', or as a number in {}.",
                     fact.condition, file)});
  const std::vector<double>& values = recording.channel(fact.condition).values;
  if (values.empty() || !std::ranges::all_of(values, [&](double value) {
        return std::isfinite(value) && value == values.front();
      }))
    throw Error(
        {.place = recording.name() + ": " + fact.condition,
         .expected = fmt::format("one number for the recording, which {} names as {}", file, name),
         .found = "values that differ or are not finite"});
  return values.front();
}

}  // namespace torsio
