#include "torsio/link/register_table.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestName = 48;
constexpr std::size_t kLongestUnit = 16;
constexpr std::size_t kLongestDescription = 150;
constexpr std::size_t kMaxRegisters = 65535;

void require_text(const std::string& place, std::string_view what, std::string_view text,
                  std::size_t longest) {
  require(text.size() <= longest, place, fmt::format("{} of at most {} bytes", what, longest),
          fmt::format("{}", text.size()));
}

bool is_number(LinkValueType type) noexcept {
  return type == LinkValueType::int32 || type == LinkValueType::uint32 ||
         type == LinkValueType::float64;
}

double number_of(const LinkValue& value) noexcept {
  if (value.type == LinkValueType::int32) return value.int32;
  return value.type == LinkValueType::uint32 ? value.uint32 : value.float64;
}

void check_register(const LinkRegister& each, std::size_t index) {
  const std::string place = fmt::format("register {} ({})", index, each.name);
  require(!each.name.empty(), place, "a name", "none");
  require_text(place, "a name", each.name, kLongestName);
  require_text(place, "a unit", each.unit, kLongestUnit);
  require_text(place, "a description", each.description, kLongestDescription);
  require(each.lowest <= each.highest, place, "limits in ascending order",
          fmt::format("{} and {}", each.lowest, each.highest));
  require(each.get != nullptr, place, "a function that returns the value", "none");
  require(each.access == LinkAccess::read || each.set != nullptr, place,
          "a function that writes the value, or access `read`", "none");
}

}  // namespace

RegisterTable::RegisterTable(std::span<const LinkRegister> registers) : registers_(registers) {
  require(registers.size() <= kMaxRegisters, "registers", fmt::format("at most {}", kMaxRegisters),
          fmt::format("{}", registers.size()));
  for (std::size_t k = 0; k < registers.size(); ++k) {
    check_register(registers[k], k);
    const auto first = find(registers[k].name);
    require(first == k, fmt::format("register {}", k), "a name of its own",
            fmt::format("'{}', which register {} has", registers[k].name, first.value_or(0)));
  }
}

std::optional<std::uint16_t> RegisterTable::find(std::string_view name) const noexcept {
  for (std::size_t k = 0; k < registers_.size(); ++k)
    if (registers_[k].name == name) return static_cast<std::uint16_t>(k);
  return std::nullopt;
}

LinkRefusal RegisterTable::read(std::uint16_t index, LinkValue& value) const noexcept {
  if (index >= registers_.size()) return LinkRefusal::unknown_register;
  value = registers_[index].get(registers_[index].context);
  return LinkRefusal::none;
}

LinkRefusal RegisterTable::write(std::uint16_t index, const LinkValue& value,
                                 bool is_disabled) const noexcept {
  if (index >= registers_.size()) return LinkRefusal::unknown_register;
  const LinkRegister& each = registers_[index];
  if (each.access == LinkAccess::read) return LinkRefusal::read_only;
  if (each.access == LinkAccess::write_when_disabled && !is_disabled)
    return LinkRefusal::only_when_disabled;
  if (value.type != each.type) return LinkRefusal::wrong_type;
  if (is_number(value.type)) {
    const double number = number_of(value);
    if (!std::isfinite(number)) return LinkRefusal::not_finite;
    if (number < each.lowest || number > each.highest) return LinkRefusal::out_of_range;
  }
  return each.set(each.context, value);
}

LinkRefusal RegisterTable::describe(std::uint16_t index,
                                    LinkRegisterDescription& description) const noexcept {
  if (index >= registers_.size()) return LinkRefusal::unknown_register;
  const LinkRegister& each = registers_[index];
  description = {.index = index,
                 .count = static_cast<std::uint16_t>(registers_.size()),
                 .type = each.type,
                 .access = each.access,
                 .is_persistent = static_cast<std::uint8_t>(each.is_persistent ? 1 : 0),
                 .lowest = each.lowest,
                 .highest = each.highest,
                 .name = each.name,
                 .unit = each.unit,
                 .description = each.description};
  return LinkRefusal::none;
}

}  // namespace torsio
