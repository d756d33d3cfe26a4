#include "arm/urdf_attributes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestShown = 40;
constexpr std::string_view kSpace = " \t\r\n";

/// Takes a number from the front of a text. @returns none if there is no finite one
std::optional<double> take_number(std::string_view& rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kSpace), rest.size()));
  std::string_view digits = rest;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  if (digits.empty() || (rest.front() == '+' && digits.front() == '-')) return std::nullopt;
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  digits.remove_prefix(static_cast<std::size_t>(end - digits.data()));
  if (!digits.empty() && kSpace.find(digits.front()) == std::string_view::npos) return std::nullopt;
  rest = digits;
  return value;
}

std::string number_advice(std::string_view text) {
  if (text.find("${") != std::string_view::npos)
    return "Expand the macros of this file first: xacro robot.urdf.xacro > robot.urdf";
  if (text.find(',') != std::string_view::npos)
    return "Numbers have a point before the decimals, and spaces between them.";
  return {};
}

/// Rz(yaw) Ry(pitch) Rx(roll)
Matrix3 rotation_of(const Vector3& rpy) {
  const double cr = std::cos(rpy[0]);
  const double sr = std::sin(rpy[0]);
  const double cp = std::cos(rpy[1]);
  const double sp = std::sin(rpy[1]);
  const double cy = std::cos(rpy[2]);
  const double sy = std::sin(rpy[2]);
  return {cy * cp,
          cy * sp * sr - sy * cr,
          cy * sp * cr + sy * sr,
          sy * cp,
          sy * sp * sr + cy * cr,
          sy * sp * cr - cy * sr,
          -sp,
          cp * sr,
          cp * cr};
}

}  // namespace

std::string shown(std::string_view text) {
  std::size_t length = std::min(text.size(), kLongestShown);
  // A letter of UTF-8 is not cut in two.
  while (length < text.size() && length > 0 &&
         (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U)
    --length;
  std::string of(text.substr(0, length));
  std::ranges::replace_if(
      of, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return length < text.size() ? of + "..." : of;
}

std::string UrdfAttributes::place() const {
  return fmt::format("{}: line {}: <{}>", file_, line_, shown(element_));
}

std::optional<std::string_view> UrdfAttributes::find(std::string_view name) const {
  for (const char* const* at = values_; *at != nullptr; at += 2)
    if (name == *at) return at[1];
  return std::nullopt;
}

std::string_view UrdfAttributes::at(std::string_view name) const {
  const auto value = find(name);
  if (value && !value->empty()) return *value;
  throw Error({.place = place(),
               .expected = fmt::format("an attribute '{}'", name),
               .found = value ? "an empty one" : "none"});
}

double UrdfAttributes::number(std::string_view name) const {
  std::array<double, 1> value;
  read(name, at(name), "a number", value);
  return value[0];
}

Vector3 UrdfAttributes::triple(std::string_view name, const Vector3& missing) const {
  const auto text = find(name);
  if (!text) return missing;
  Vector3 of;
  read(name, *text, "three numbers", of);
  return of;
}

ArmFrame UrdfAttributes::frame() const {
  constexpr std::array<std::string_view, 2> kNames = {"xyz", "rpy"};
  allow_only(kNames);
  return {triple("xyz", {}), rotation_of(triple("rpy", {}))};
}

void UrdfAttributes::allow_only(std::span<const std::string_view> names) const {
  for (const char* const* at = values_; *at != nullptr; at += 2) {
    const std::string_view name = *at;
    if (name.find(':') != std::string_view::npos || std::ranges::find(names, name) != names.end())
      continue;
    const std::string advice = did_you_mean(name, names);
    throw Error({.place = place(),
                 .expected = fmt::format("no attribute but {}", fmt::join(names, ", ")),
                 .found = fmt::format("'{}'", shown(name)),
                 .advice = advice.empty() ? "torsio does not read it; write it with these, or "
                                            "remove it."
                                          : advice});
  }
}

void UrdfAttributes::read(std::string_view name, std::string_view text, std::string_view expected,
                          std::span<double> into) const {
  const auto refuse = [&] {
    throw Error({.place = fmt::format("{}: {}", place(), name),
                 .expected = std::string(expected),
                 .found = fmt::format("'{}'", shown(text)),
                 .advice = number_advice(text)});
  };
  std::string_view rest = text;
  for (double& value : into) {
    const auto number = take_number(rest);
    if (!number) refuse();
    value = *number;
  }
  if (rest.find_first_not_of(kSpace) != std::string_view::npos) refuse();
}

}  // namespace torsio
