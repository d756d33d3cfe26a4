#pragma once

// Written by tools/link_messages from share/torsio/link/messages.yaml; change that file instead.

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace torsio {

/// State of the drive of a joint.
enum class LinkDriveState : std::uint8_t {
  initialising,  ///< the joint starts; it cannot be enabled
  ready,         ///< no current flows; it can be enabled
  enabled,       ///< references are executed
  fault,         ///< no current flows until the fault is reset
  stop,          ///< a stop is executed, or has ended; latched until it is disabled
};
inline constexpr std::size_t kLinkDriveStates = 5;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkDriveState value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkDriveState value) noexcept;

/// What a host requests of the state.
enum class LinkStateCommand : std::uint8_t {
  heartbeat,    ///< nothing changes; the motion continues for the time of the watchdog
  enable,       ///< ready -> enabled
  disable,      ///< enabled or stop -> ready
  reset_fault,  ///< fault -> ready, if its cause has ended
  release,      ///< the host gives up control; an enabled joint stops
};
inline constexpr std::size_t kLinkStateCommands = 5;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkStateCommand value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkStateCommand value) noexcept;

/// Why a joint is in the state in which it is.
enum class LinkStateReason : std::uint8_t {
  none,           ///< it has not been in a fault or a stop
  requested,      ///< a host requested it
  host_lost,      ///< no motion command within the time of the watchdog
  host_released,  ///< the controlling host gave up control while the joint was enabled
  clock,          ///< the clock of the joint ran backwards
  joint_fault,    ///< the joint detected a fault
};
inline constexpr std::size_t kLinkStateReasons = 6;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkStateReason value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkStateReason value) noexcept;

/// Type of a register.
enum class LinkValueType : std::uint8_t {
  boolean,  ///< one byte, 0 or 1
  int32,    ///< four bytes, two's complement
  uint32,   ///< four bytes
  float64,  ///< eight bytes, IEEE 754
  text,     ///< one byte with the length, then UTF-8
};
inline constexpr std::size_t kLinkValueTypes = 5;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkValueType value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkValueType value) noexcept;

/// When a register may be written.
enum class LinkAccess : std::uint8_t {
  read,                 ///< never
  write,                ///< always
  write_when_disabled,  ///< not while the joint is enabled or stops
};
inline constexpr std::size_t kLinkAccesss = 3;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkAccess value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkAccess value) noexcept;

/// Why a command or request was not executed.
enum class LinkRefusal : std::uint8_t {
  none,         ///< it was executed
  checksum,     ///< the CRC-32 is wrong
  broadcast,    ///< only a stop may be sent to every joint
  from_future,  ///< it carries a time that the clock of the joint has not reached
  too_old,      ///< it is older than the time of the watchdog, or than the end of the last control
  other_host,   ///< another host is in control
  repeated,     ///< its sequence is not above that of the last accepted command
  deadline,     ///< it arrived after its own deadline
  unknown_message,       ///< no message has this id
  wrong_version,         ///< the layout has another version
  wrong_length,          ///< the payload has another length than its layout
  unknown_value,         ///< an enumeration has no such value
  not_finite,            ///< a number is NaN or infinite
  unknown_register,      ///< no register has this index
  wrong_type,            ///< the register has another type
  out_of_range,          ///< the value is outside the limits
  read_only,             ///< the register cannot be written
  only_when_disabled,    ///< the joint is enabled: disable it first
  not_in_this_state,     ///< the state of the joint does not permit it
  not_supported,         ///< this joint does not offer it
  too_many_subscribers,  ///< every subscription is in use
  line_too_slow,         ///< the line cannot carry the telemetry
  upload_out_of_order,   ///< the part does not follow the one before
  upload_rejected,       ///< the joint cannot use what was uploaded
};
inline constexpr std::size_t kLinkRefusals = 24;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkRefusal value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkRefusal value) noexcept;

/// State of an upload.
enum class LinkUploadState : std::uint8_t {
  idle,       ///< there is none
  receiving,  ///< parts are missing
  complete,   ///< every byte has arrived
  committed,  ///< the joint uses it
  rejected,   ///< the joint cannot use it
};
inline constexpr std::size_t kLinkUploadStates = 5;
/// The enumerator's own spelling.
[[nodiscard]] std::string_view name(LinkUploadState value) noexcept;
/// Its meaning in English.
[[nodiscard]] std::string_view meaning(LinkUploadState value) noexcept;

}  // namespace torsio
