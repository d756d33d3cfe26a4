#include "checks.hpp"

#include <fmt/format.h>

#include <cmath>

namespace torsio {

std::string as_text(double value) { return fmt::format("{}", value); }

template <class Mistake>
void refuse(const ErrorPlace& place, std::string_view expected, std::string_view found,
            std::string_view advice) {
  throw Mistake(
      {.place = fmt::format("{}{}{}", place.owner, place.field.empty() ? "" : ": ", place.field),
       .expected = std::string(expected),
       .found = std::string(found),
       .advice = std::string(advice)});
}

template <class Mistake>
void refuse(const ErrorPlace& place, std::string_view expected, double found) {
  refuse<Mistake>(place, expected, as_text(found));
}

template void refuse<Error>(const ErrorPlace&, std::string_view, std::string_view,
                            std::string_view);
template void refuse<Error>(const ErrorPlace&, std::string_view, double);
template void refuse<UsageError>(const ErrorPlace&, std::string_view, std::string_view,
                                 std::string_view);
template void refuse<UsageError>(const ErrorPlace&, std::string_view, double);

void require_parameter(bool holds, std::string_view place, const std::string& expected,
                       double found) {
  if (holds) return;
  throw Error({.place = std::string(place),
               .problem = "impossible parameter",
               .expected = expected,
               .found = as_text(found)});
}

void require_positive(std::string_view place, std::string_view name, double value) {
  require_parameter(value > 0.0 && std::isfinite(value), place,
                    fmt::format("{} > 0 and finite", name), value);
}

void require_not_negative(std::string_view place, std::string_view name, double value) {
  require_parameter(value >= 0.0 && std::isfinite(value), place,
                    fmt::format("{} >= 0 and finite", name), value);
}

}  // namespace torsio
