#include "model/hysteresis/slip_bank.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/checks.hpp"

namespace torsio {
namespace {

void require_not_negative(std::span<const double> values, std::string_view field,
                          std::string_view place) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(std::isfinite(values[i]) && values[i] >= 0.0))
      refuse({place, fmt::format("{} of element {}", field, i + 1)}, "a number not below 0",
             values[i]);
}

}  // namespace

SlipBank::SlipBank(std::span<const double> stiffness, std::span<const double> limit,
                   std::string_view place)
    : size_(limit.size()) {
  if (stiffness.size() != limit.size())
    throw Error({.place = std::string(place),
                 .expected = "a stiffness for each limit",
                 .found = fmt::format("{} and {}", stiffness.size(), limit.size())});
  require_not_negative(stiffness, "stiffness", place);
  require_not_negative(limit, "limit", place);
  const std::size_t padded = (size_ + kLanes - 1) / kLanes * kLanes;
  stiffness_.assign(padded, 0.0);
  limit_.assign(padded, 0.0);
  force_.assign(padded, 0.0);
  std::ranges::copy(stiffness, stiffness_.begin());
  std::ranges::copy(limit, limit_.begin());
}

SlipBank::SlipBank(std::span<const double> threshold, std::string_view place)
    : SlipBank(std::vector<double>(threshold.size(), 1.0), threshold, place) {}

void SlipBank::reset() noexcept { std::ranges::fill(force_, 0.0); }

void SlipBank::set_forces(std::span<const double> forces) noexcept {
  for (std::size_t i = 0; i < size_; ++i)
    if (std::isfinite(forces[i])) force_[i] = std::clamp(forces[i], -limit_[i], limit_[i]);
}

}  // namespace torsio
