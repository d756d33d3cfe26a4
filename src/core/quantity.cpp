#include "core/quantity.hpp"

#include <charconv>
#include <cmath>
#include <string>

#include "core/trimmed.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

double signed_quantity_with_unit(std::string_view text, std::string_view expected_si,
                                 std::string_view place) {
  const std::string_view all = trimmed(text);
  double number = 0.0;
  const auto [end, code] = std::from_chars(all.data(), all.data() + all.size(), number);
  const bool is_bare =
      std::isfinite(number) && code == std::errc{} && end == all.data() + all.size();
  const bool is_same_in_each_unit = expected_si == "1" || number == 0.0;
  if (is_bare && !is_same_in_each_unit)
    throw UsageError(
        {.place = std::string(place),
         .expected =
             "a number with its unit, " + std::string(expected_si) + " or another of the quantity",
         .found = "'" + std::string(text) + "'",
         .advice = "Write " + std::string(all) + std::string(expected_si) + " if that is meant."});
  return si_quantity(text, expected_si, place);
}

double quantity_with_unit(std::string_view text, std::string_view expected_si,
                          std::string_view place) {
  const double value = signed_quantity_with_unit(text, expected_si, place);
  if (value < 0.0)
    throw UsageError({.place = std::string(place),
                      .expected = "a value that is not negative",
                      .found = "'" + std::string(text) + "'"});
  return value;
}

}  // namespace torsio
