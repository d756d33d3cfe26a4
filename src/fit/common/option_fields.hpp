#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "torsio/fit/common/options.hpp"

// The options of a fitter are declared in one place: its options struct states name, range and help
// next to its fields. Kind and default come from the fields themselves.
//
//     struct MineOptions {
//       double scale = kNotMeasured;  // "auto"
//       Shape shape = Shape::round;   // an enumeration counted from 0
//
//       template <class Self, class Visit>
//       static void visit_options(Self& self, const Visit& visit) {
//         visit(self.scale, {.name = "scale", .minimum = 0, .maximum = 10, .help = "..."});
//         visit(self.shape, {.name = "shape", .help = "...", .choices = kShapeNames});
//       }
//     };

namespace torsio {
namespace detail {

using NineNumbers = std::array<double, 9>;

[[nodiscard]] std::string option_text(bool value);
[[nodiscard]] std::string option_text(double value);  ///< NaN: "auto"
[[nodiscard]] std::string option_text(std::size_t value);
[[nodiscard]] std::string option_text(const std::string& value);
[[nodiscard]] std::string option_text(const std::optional<std::size_t>& value);  ///< empty: "auto"
[[nodiscard]] std::string option_text(const std::vector<std::size_t>& value);    ///< "50-20-10"
[[nodiscard]] std::string option_text(const std::optional<NineNumbers>& value);  ///< empty: ""

/// Each @throws UsageError for text that `Options` accepts as text but the field does not.
void read_option(std::string_view text, const OptionInfo& stated, bool& value);
void read_option(std::string_view text, const OptionInfo& stated, double& value);
void read_option(std::string_view text, const OptionInfo& stated, std::size_t& value);
void read_option(std::string_view text, const OptionInfo& stated, std::string& value);
void read_option(std::string_view text, const OptionInfo& stated,
                 std::optional<std::size_t>& value);
void read_option(std::string_view text, const OptionInfo& stated, std::vector<std::size_t>& value);
void read_option(std::string_view text, const OptionInfo& stated,
                 std::optional<NineNumbers>& value);
/// Position among the choices. @throws UsageError that lists them.
[[nodiscard]] std::size_t chosen(std::string_view text, const OptionInfo& stated);

template <class Field>
constexpr bool kIsOptionalChoice = false;
template <class Choice>
inline constexpr bool kIsOptionalChoice<std::optional<Choice>> = std::is_enum_v<Choice>;

/// Fields that are set by a name: enumerations and switches by position; an optional one is empty at
/// the first name.
template <class Field>
[[nodiscard]] std::size_t position_of(const Field& value) {
  if constexpr (kIsOptionalChoice<Field>) {
    return value ? static_cast<std::size_t>(*value) + 1 : 0;
  } else {
    return static_cast<std::size_t>(value);
  }
}
template <class Field>
void set_position(Field& value, std::size_t position) {
  if constexpr (!kIsOptionalChoice<Field>) {
    value = static_cast<Field>(position);
  } else if (position == 0) {
    value.reset();
  } else {
    value = static_cast<typename Field::value_type>(position - 1);
  }
}

template <class Field>
constexpr bool kIsNamed =
    std::is_enum_v<Field> || std::same_as<Field, bool> || kIsOptionalChoice<Field>;

template <class Field>
[[nodiscard]] OptionInfo::Kind kind_of(const OptionInfo& stated) {
  using Kind = OptionInfo::Kind;
  if (!stated.choices.empty()) return Kind::choice;
  if constexpr (std::same_as<Field, bool>) return Kind::boolean;
  if constexpr (std::same_as<Field, double>) return Kind::number;
  if constexpr (std::same_as<Field, std::size_t> || std::same_as<Field, std::optional<std::size_t>>)
    return Kind::integer;
  return Kind::text;
}

template <class Field>
[[nodiscard]] std::string default_text(const Field& value, const OptionInfo& stated) {
  if constexpr (kIsNamed<Field>)
    if (!stated.choices.empty()) return std::string(stated.choices[position_of(value)]);
  if constexpr (!std::is_enum_v<Field> && !kIsOptionalChoice<Field>) return option_text(value);
  return {};
}

}  // namespace detail

/// The table of an options struct.
template <class Own>
[[nodiscard]] std::span<const OptionInfo> options_of() {
  struct OptionTable {
    std::vector<OptionInfo> options;
    std::deque<std::string> defaults;  // a deque: the views in `options` stay valid
  };
  static const OptionTable table = [] {
    OptionTable made;
    const Own own;
    Own::visit_options(own, [&]<class Field>(const Field& value, OptionInfo stated) {
      stated.kind = detail::kind_of<Field>(stated);
      stated.default_value = made.defaults.emplace_back(detail::default_text(value, stated));
      made.options.push_back(stated);
    });
    return made;
  }();
  return table.options;
}

/// An options struct with the user's settings. @throws UsageError if a text is not valid for its
/// field.
template <class Own>
[[nodiscard]] Own filled(const Options& given) {
  Own own;
  Own::visit_options(own, [&]<class Field>(Field& value, const OptionInfo& stated) {
    const std::string& text = given.text(stated.name);
    if constexpr (detail::kIsNamed<Field>)
      if (!stated.choices.empty()) return detail::set_position(value, detail::chosen(text, stated));
    if constexpr (!std::is_enum_v<Field> && !detail::kIsOptionalChoice<Field>)
      detail::read_option(text, stated, value);
  });
  return own;
}

}  // namespace torsio
