#pragma once

#include <concepts>
#include <string>
#include <string_view>

#include "torsio/core/error.hpp"

namespace torsio {

/// "grey_box: bound", or a place of one part. Joined only for a message.
struct ErrorPlace {
  template <std::convertible_to<std::string_view> Text>
  ErrorPlace(const Text& whole) : owner(whole) {}
  ErrorPlace(std::string_view of, std::string_view part) : owner(of), field(part) {}

  std::string_view owner;
  std::string_view field;
};

/// The fewest digits that give the same number again: 1e-9 stays 1e-09.
[[nodiscard]] std::string as_text(double value);

/// @throws Mistake "<place>: expected <expected>, found <found>", and the advice on a second line.
/// For `Error` and `UsageError`.
template <class Mistake = Error>
[[noreturn]] void refuse(const ErrorPlace& place, std::string_view expected, std::string_view found,
                         std::string_view advice = {});
template <class Mistake = Error>
[[noreturn]] void refuse(const ErrorPlace& place, std::string_view expected, double found);

template <class Mistake = Error, class Found>
void require(bool holds, const ErrorPlace& place, std::string_view expected, const Found& found) {
  if (!holds) refuse<Mistake>(place, expected, found);
}

/// @throws Error "<place>: impossible parameter; expected <name> <what>, found <value>" if a
/// parameter of a part or of a controller is not as it must be; NaN never is.
void require_parameter(bool holds, std::string_view place, const std::string& expected,
                       double found);
void require_positive(std::string_view place, std::string_view name, double value);
void require_not_negative(std::string_view place, std::string_view name, double value);

}  // namespace torsio
