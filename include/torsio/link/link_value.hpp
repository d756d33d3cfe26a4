#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "torsio/link/link_enumerations.hpp"

namespace torsio {

inline constexpr std::size_t kLinkChannels = 32;      ///< per joint, in the telemetry
inline constexpr std::size_t kLongestLinkText = 200;  ///< bytes of a register's text

/// Values of channels, without the heap.
struct LinkFloats {
  std::uint8_t count = 0;
  std::array<float, kLinkChannels> values = {};
};

/// The value of a register: the member that its type names. A text belongs to someone else: to the register, or to the
/// payload from which it was read.
struct LinkValue {
  LinkValueType type = LinkValueType::boolean;
  bool boolean = false;
  std::int32_t int32 = 0;
  std::uint32_t uint32 = 0;
  double float64 = 0.0;
  std::string_view text = {};

  [[nodiscard]] static LinkValue of(bool value) noexcept {
    return {.type = LinkValueType::boolean, .boolean = value};
  }
  [[nodiscard]] static LinkValue of(std::int32_t value) noexcept {
    return {.type = LinkValueType::int32, .int32 = value};
  }
  [[nodiscard]] static LinkValue of(std::uint32_t value) noexcept {
    return {.type = LinkValueType::uint32, .uint32 = value};
  }
  [[nodiscard]] static LinkValue of(double value) noexcept {
    return {.type = LinkValueType::float64, .float64 = value};
  }
  [[nodiscard]] static LinkValue of(std::string_view value) noexcept {
    return {.type = LinkValueType::text, .text = value};
  }
  /// A literal would otherwise become a bool.
  [[nodiscard]] static LinkValue of(const char* value) noexcept {
    return of(std::string_view(value));
  }

  /// For a value whose type is known to be that of the variable.
  void copy_to(bool& variable) const noexcept { variable = boolean; }
  void copy_to(std::int32_t& variable) const noexcept { variable = int32; }
  void copy_to(std::uint32_t& variable) const noexcept { variable = uint32; }
  void copy_to(double& variable) const noexcept { variable = float64; }

  /// Numbers are compared bit by bit, so that NaN is equal to itself.
  [[nodiscard]] bool operator==(const LinkValue& other) const noexcept;
};

}  // namespace torsio
