#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace torsio::detail {

/// A member of an object in memory, and its bytes in the object's state.
struct StateSegment {
  enum class Kind : std::uint8_t { bytes, flag, count };
  void* member = nullptr;
  std::size_t size = 0;    ///< in the state
  std::size_t offset = 0;  ///< in the state
  Kind kind = Kind::bytes;
};

/// The memory of an object as bytes. A class lists the members that change in a step once, for all
/// tasks:
///
///     void visit_state(StateBytes& bytes) noexcept { bytes.visit(last_, is_started_, lowpass_); }
///
/// A member is a number, a `bool`, a container of such whose size does not change, or of a class with
/// `visit_state`, or a container of such. `check` reads as `read` does, but changes nothing; `list` notes
/// where the members are, for `StateSegments`.
class StateBytes {
 public:
  enum class Task : std::uint8_t { count, write, check, read, list };

  StateBytes() = default;  ///< counts
  explicit StateBytes(std::span<std::byte> target) noexcept
      : task_(Task::write), target_(target.data()), size_(target.size()) {}
  StateBytes(Task check_or_read, std::span<const std::byte> source) noexcept
      : task_(check_or_read), source_(source.data()), size_(source.size()) {}

  explicit StateBytes(std::vector<StateSegment>& segments) noexcept
      : task_(Task::list), segments_(&segments) {}

  template <class... Members>
  void visit(Members&... members) noexcept {
    (visit_one(members), ...);
  }
  /// A number that would not be valid above `most`, such as an index: `check` refuses it.
  template <std::unsigned_integral Number>
  void visit_at_most(Number& number, std::size_t most) noexcept {
    if (task_ == Task::list) {
      static_assert(sizeof(Number) == 1 || sizeof(Number) == sizeof(std::uint64_t));
      return add_segment(
          &number, sizeof(std::uint64_t),
          sizeof(Number) == 1 ? StateSegment::Kind::flag : StateSegment::Kind::count);
    }
    std::uint64_t value = number;
    if (task_ == Task::check) peek(&value, sizeof value);
    visit_raw(&value, sizeof value);
    if (value > most) fail();
    if (task_ == Task::read && is_valid_) number = static_cast<Number>(value);
  }
  /// An enumerator, which is not valid above `most`.
  template <class Enum>
    requires std::is_enum_v<Enum>
  void visit_at_most(Enum& enumerator, Enum most) noexcept {
    static_assert(sizeof(Enum) == 1);
    if (task_ == Task::list)
      return add_segment(&enumerator, sizeof(std::uint64_t), StateSegment::Kind::flag);
    auto number = static_cast<std::uint8_t>(enumerator);
    visit_at_most(number, static_cast<std::uint8_t>(most));
    if (task_ == Task::read && is_valid_) enumerator = static_cast<Enum>(number);
  }
  /// The members exchange their memory in a step: `StateSegments` cannot be used.
  void refuse_list() noexcept {
    if (task_ == Task::list) fail();
  }
  /// The object cannot be saved, or the bytes are not its own.
  void fail() noexcept { is_valid_ = false; }

  [[nodiscard]] bool is_valid() const noexcept { return is_valid_; }
  /// Bytes so far.
  [[nodiscard]] std::size_t position() const noexcept { return position_; }

 private:
  template <class Member>
  void visit_one(Member& member) noexcept {
    if constexpr (requires { member.visit_state(*this); }) {
      member.visit_state(*this);
    } else if constexpr (std::same_as<Member, bool>) {
      if (task_ == Task::list)
        return add_segment(&member, sizeof(std::uint64_t), StateSegment::Kind::flag);
      auto flag = static_cast<std::uint8_t>(member);
      visit_at_most(flag, 1);
      if (task_ == Task::read) member = flag != 0;
    } else if constexpr (std::is_arithmetic_v<Member>) {
      visit_raw(&member, sizeof member);
    } else if constexpr (std::is_arithmetic_v<std::ranges::range_value_t<Member>>) {
      static_assert(std::ranges::contiguous_range<Member>);
      visit_raw(std::ranges::data(member),
                std::ranges::size(member) * sizeof(std::ranges::range_value_t<Member>));
    } else {
      for (auto& each : member) visit_one(each);
    }
  }
  void visit_raw(void* data, std::size_t size) noexcept;
  void add_segment(void* member, std::size_t size, StateSegment::Kind kind) noexcept;
  void peek(void* data, std::size_t size) const noexcept;

  Task task_ = Task::count;
  bool is_valid_ = true;
  std::byte* target_ = nullptr;
  const std::byte* source_ = nullptr;
  std::size_t size_ = 0;
  std::size_t position_ = 0;
  std::vector<StateSegment>* segments_ = nullptr;
};

/// The members of an object whose state is exchanged many times, such as that of one model for many
/// joints: faster than its `visit_state`, and without checks. The object must not move.
class StateSegments {
 public:
  StateSegments() = default;
  template <class Visit>
  explicit StateSegments(const Visit& visit) {
    StateBytes bytes(segments_);
    visit(bytes);
    is_valid_ = bytes.is_valid();
  }
  [[nodiscard]] bool is_valid() const noexcept { return is_valid_; }
  /// @param bytes written by `write` or by the object's own `visit_state`
  void read(std::span<const std::byte> bytes) const noexcept;
  void write(std::span<std::byte> bytes) const noexcept;

 private:
  std::vector<StateSegment> segments_;
  bool is_valid_ = false;
};

/// A hash of numbers and texts, which differs for the states of different models; not a protection
/// against a state that was made to agree.
class StateHash {
 public:
  void add(std::uint64_t word) noexcept;
  void add_bytes(const void* data, std::size_t size) noexcept;
  void add(std::string_view text) noexcept { add_bytes(text.data(), text.size()); }

  /// All fields of plain data, as far as they are numbers, texts, or lists or structures of those.
  template <class Value>
  void add_value(const Value& value) noexcept {
    if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value>) {
      add_bytes(&value, sizeof value);
    } else if constexpr (std::convertible_to<const Value&, std::string_view>) {
      add(std::string_view(value));
    } else if constexpr (requires { Value::visit_fields(value, [](std::string_view, auto&) {}); }) {
      Value::visit_fields(value, [&](std::string_view, const auto& field) { add_value(field); });
    } else if constexpr (requires { value.rows, value.columns, value.values; }) {
      add(value.rows);
      add_value(value.values);
    } else if constexpr (requires { value.has_value(), *value; }) {
      add(std::uint64_t{value.has_value()});
      if (value.has_value()) add_value(*value);
    } else if constexpr (requires { value.index(), value.valueless_by_exception(); }) {
      add(value.index());
      add_alternative(value, std::make_index_sequence<std::variant_size_v<Value>>());
    } else {
      static_assert(std::ranges::sized_range<Value>,
                    "the hash of this type is not defined: give it visit_fields");
      add(std::ranges::size(value));
      if constexpr (std::is_arithmetic_v<std::ranges::range_value_t<Value>> &&
                    std::ranges::contiguous_range<Value>) {
        add_bytes(std::ranges::data(value),
                  std::ranges::size(value) * sizeof(std::ranges::range_value_t<Value>));
      } else {
        for (const auto& each : value) add_value(each);
      }
    }
  }

  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  // std::visit could throw for a variant without a value. Clang 14 needs `this->` in a generic lambda.
  template <class Variant, std::size_t... I>
  void add_alternative(const Variant& of, std::index_sequence<I...> /*alternatives*/) noexcept {
    const auto add_if = [this](const auto* alternative) {
      if (alternative != nullptr) this->add_value(*alternative);
    };
    (add_if(std::get_if<I>(&of)), ...);
  }

  std::uint64_t value_ = 0xcbf29ce484222325U;
};

/// Before the members: what it is, whose state, how many bytes follow, their checksum; 8 bytes each.
inline constexpr std::size_t kStateHeaderBytes = 32;
void write_state_header(std::span<std::byte> bytes, std::uint64_t identity) noexcept;
/// Whether the header is that of a state with this identity, and its bytes are those that were saved.
[[nodiscard]] bool is_state_of(std::span<const std::byte> bytes, std::uint64_t identity) noexcept;

/// Bytes of a saved state; 0 if the object cannot be saved.
template <class Object>
[[nodiscard]] std::size_t state_size(const Object& object) noexcept {
  StateBytes bytes;
  // Only `read` changes members.
  const_cast<Object&>(object).visit_state(bytes);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  return bytes.is_valid() ? kStateHeaderBytes + bytes.position() : 0;
}

/// @param target `state_size` bytes. @returns false, without effect, if it has another size, or if the
/// object cannot be saved.
template <class Object>
[[nodiscard]] bool save_state(const Object& object, std::uint64_t identity,
                              std::span<std::byte> target) noexcept {
  if (target.empty() || target.size() != state_size(object)) return false;
  StateBytes bytes(target.subspan(kStateHeaderBytes));
  const_cast<Object&>(object).visit_state(bytes);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  write_state_header(target, identity);
  return true;
}

/// @returns false, without effect, for bytes that `save_state` did not write for such an object.
template <class Object>
[[nodiscard]] bool load_state(Object& object, std::uint64_t identity,
                              std::span<const std::byte> source) noexcept {
  if (source.empty() || source.size() != state_size(object)) return false;
  if (!is_state_of(source, identity)) return false;
  StateBytes check(StateBytes::Task::check, source.subspan(kStateHeaderBytes));
  object.visit_state(check);
  if (!check.is_valid()) return false;
  StateBytes read(StateBytes::Task::read, source.subspan(kStateHeaderBytes));
  object.visit_state(read);
  return true;
}

}  // namespace torsio::detail
