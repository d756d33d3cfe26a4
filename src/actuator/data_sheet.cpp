#include "torsio/actuator/data_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <utility>

#include "actuators.hpp"
#include "core/did_you_mean.hpp"
#include "core/fnv_hash.hpp"
#include "sheet_values.hpp"
#include "specimen_spread.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

struct ActuatorName {
  std::string_view base;
  std::string_view variant;  ///< empty: the default
  std::optional<unsigned> serial;
};

[[noreturn]] void refuse_name(std::string_view what, std::string expected, std::string_view found,
                              std::span<const std::string_view> known = {}) {
  const std::string nearest = did_you_mean(found, known);
  throw UsageError(
      {.place = "actuator",
       .problem = fmt::format("unknown {}", what),
       .expected = std::move(expected),
       .found = fmt::format("\"{}\"", found),
       .advice = (nearest.empty() ? "" : nearest + " ") + "torsio simulate --list shows them"});
}

std::optional<unsigned> serial_of(std::string_view digits) {
  unsigned serial = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), serial);
  if (error != std::errc() || end != digits.data() + digits.size() || serial > 9999)
    refuse_name("serial number", "0 to 9999 after the #, as dfki-300#03", digits);
  return serial;
}

ActuatorName parse(std::string_view text) {
  ActuatorName name{.base = text, .variant = {}, .serial = {}};
  if (const auto mark = name.base.find('#'); mark != std::string_view::npos) {
    name.serial = serial_of(name.base.substr(mark + 1));
    name.base = name.base.substr(0, mark);
  }
  if (const auto mark = name.base.find(':'); mark != std::string_view::npos) {
    name.variant = name.base.substr(mark + 1);
    name.base = name.base.substr(0, mark);
    if (name.variant.empty()) refuse_name("variant", "a name after the colon", text);
  }
  return name;
}

template <class Range>
std::string one_of(const Range& names) {
  return fmt::format("one of {}", fmt::join(names, ", "));
}

}  // namespace

std::vector<SheetRow> describe(const DataSheet& sheet) {
  std::vector<SheetRow> rows;
  visit_values(sheet, [&](std::string name, std::string_view unit, const SheetValue& value) {
    rows.push_back({std::move(name), unit, value});
  });
  return rows;
}

DataSheet data_sheet(std::string_view name) {
  const ActuatorName parts = parse(name);
  const auto sheets = data_sheets();
  const auto found = std::ranges::find(sheets, parts.base, &DataSheet::name);
  if (found == sheets.end()) {
    std::vector<std::string_view> known(sheets.size());
    std::ranges::transform(sheets, known.begin(), &DataSheet::name);
    refuse_name("name", one_of(known), parts.base, known);
  }
  DataSheet sheet = *found;
  if (!parts.variant.empty()) {
    std::vector<std::string_view> known(sheet.variants.begin(), sheet.variants.end());
    std::erase(known, "");
    if (std::ranges::find(known, parts.variant) == known.end()) {
      refuse_name(fmt::format("variant of {}", sheet.name),
                  known.empty() ? "none: it has no variants" : one_of(known), parts.variant, known);
    }
    set_variant(sheet, parts.variant);
  }
  sheet.serial = parts.serial;
  spread_specimen(sheet);
  return sheet;
}

std::string full_name(const DataSheet& sheet) {
  std::string name(sheet.name);
  if (sheet.variant != sheet.variants.front()) name += fmt::format(":{}", sheet.variant);
  if (sheet.serial) name += fmt::format("#{:02}", *sheet.serial);
  return name;
}

std::string sheet_hash(const DataSheet& sheet) {
  // The name as well: the difference between two variants need not be a number.
  std::string text = full_name(sheet);
  for (const SheetRow& row : describe(sheet))
    text += fmt::format(" {}={:016x}", row.name, std::bit_cast<std::uint64_t>(row.value.value));
  return fmt::format("{:016x}", text_hash(text));
}

}  // namespace torsio
