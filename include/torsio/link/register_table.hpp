#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "torsio/core/realtime.hpp"
#include "torsio/link/link_messages.hpp"
#include "torsio/link/link_value.hpp"

namespace torsio {

/// A parameter or a measured value of a joint that a host can read, and perhaps write.
struct LinkRegister {
  std::string_view name =
      {};  ///< at most 48 bytes, unique in the joint, with the unit: "largest_torque_Nm"
  std::string_view unit = {};         ///< at most 16 bytes; empty: none
  std::string_view description = {};  ///< at most 150 bytes
  LinkValueType type = LinkValueType::float64;
  LinkAccess access = LinkAccess::read;
  bool is_persistent = false;  ///< it keeps its value without power
  /// Limits for writing a number; what is read may be outside.
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();

  /// @returns the value, with the type of the register
  LinkValue (*get)(const void* context) noexcept = nullptr;
  /// Is called with a value of the right type, finite and within the limits. @returns `none`, or why it is refused
  LinkRefusal (*set)(void* context, const LinkValue& value) noexcept = nullptr;
  void* context = nullptr;
};

/// A register that is a variable: a bool, std::int32_t, std::uint32_t or double that outlives the table, and that only the
/// thread of the table uses. Fills in type, get, set and context.
template <class T>
[[nodiscard]] LinkRegister variable_register(LinkRegister described, T& variable) noexcept {
  described.type = LinkValue::of(variable).type;
  described.get = [](const void* context) noexcept {
    return LinkValue::of(*static_cast<const T*>(context));
  };
  described.set = [](void* context, const LinkValue& value) noexcept {
    value.copy_to(*static_cast<T*>(context));
    return LinkRefusal::none;
  };
  described.context = &variable;
  return described;
}

/// The registers of a joint, by their index. Reads and writes use no heap.
class RegisterTable {
 public:
  /// @param registers outlive the table
  /// @throws Error that names the register if a name is empty or repeated, a text too long, the limits are in the wrong
  /// order, or a function that the access needs is missing.
  explicit RegisterTable(std::span<const LinkRegister> registers);

  [[nodiscard]] std::size_t size() const noexcept { return registers_.size(); }
  [[nodiscard]] std::span<const LinkRegister> registers() const noexcept { return registers_; }
  [[nodiscard]] std::optional<std::uint16_t> find(std::string_view name) const noexcept;

  /// @returns `none`, or `unknown_register`
  [[nodiscard]] LinkRefusal read(std::uint16_t index,
                                 LinkValue& value) const noexcept TORSIO_REALTIME;
  /// @param is_disabled the joint neither moves nor stops
  /// @returns `none`, or why nothing was written: `unknown_register`, `read_only`, `only_when_disabled`, `wrong_type`,
  /// `not_finite`, `out_of_range`, or what the register's own function returns
  [[nodiscard]] LinkRefusal write(std::uint16_t index, const LinkValue& value,
                                  bool is_disabled) const noexcept TORSIO_REALTIME;
  /// @returns `none`, or `unknown_register`
  [[nodiscard]] LinkRefusal describe(
      std::uint16_t index, LinkRegisterDescription& description) const noexcept TORSIO_REALTIME;

 private:
  std::span<const LinkRegister> registers_;
};

/// All registers with values and descriptions, as a JSON array. Not for real-time code. Numbers that are not finite become
/// null, bytes that are not UTF-8 U+FFFD.
[[nodiscard]] std::string json_of(const RegisterTable& table);

}  // namespace torsio
