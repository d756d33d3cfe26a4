#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "torsio/export/c99.hpp"
#include "torsio/export/c_cost.hpp"

namespace torsio {

/// The parts of a C file while it is written. In templates `@` is the prefix of all names, `NAME_`, and
/// `$KEY$` for a value.
class CText {
 public:
  using Value = std::pair<std::string_view, std::string>;

  CText(std::string name, CReal real) : name_(std::move(name)), real_(real) {}

  [[nodiscard]] CReal real() const noexcept { return real_; }
  /// A literal of the real type. @throws Error for a number that it cannot hold. @param what for the message
  [[nodiscard]] std::string number(double value, std::string_view what = {}) const;
  /// A literal of type float, for the weights of networks.
  [[nodiscard]] static std::string float_number(double value, std::string_view what);
  [[nodiscard]] std::string filled(std::string_view text,
                                   std::initializer_list<Value> values = {}) const;

  /// A table of constants, empty ones excepted; one that exists is not written again. @returns "NAME_table"
  std::string table(std::string_view name, std::span<const double> values);
  std::string float_table(std::string_view name, std::span<const float> values);
  std::string index_table(std::string_view name, std::span<const std::size_t> values);

  /// A member of the state, "float slip[8]" without its semicolon. Zero is its value after a reset.
  void member(std::string_view declaration);
  /// A type for the header, `NAME_<name>`, whose members are declarations as those of `member`. Its members may have types
  /// that were added before.
  void add_struct(std::string_view name, std::string_view comment,
                  std::span<const std::string_view> members);
  void add_struct(std::string_view name, std::string_view comment,
                  std::initializer_list<std::string_view> members) {
    add_struct(name, comment, std::span(members.begin(), members.size()));
  }
  /// @returns bytes of such a type
  [[nodiscard]] std::size_t size_of(std::string_view name) const;
  /// Whether what has this name is still to be written; from now on it is not.
  [[nodiscard]] bool claim(std::string_view what) { return claimed_.emplace(what).second; }
  /// Writes the type of the state, with the members so far.
  void end_state();
  /// Counts what a step consists of; after `begin_control` what a control step does.
  void work(CWork kind, double times = 1.0) {
    (control_work_ ? *control_work_ : work_)[static_cast<std::size_t>(kind)] += times;
  }
  /// The controller follows, whose step has the work of the estimator and its own.
  void begin_control() { control_work_ = work_; }
  /// Parts of the estimator's step that a control step does so many times more.
  void repeat_in_control(std::initializer_list<CWork> kinds, double times) {
    for (const CWork kind : kinds) work(kind, times * work_[static_cast<std::size_t>(kind)]);
  }
  /// Counts an array that a step has on its stack.
  void local_reals(std::size_t count) {
    local_bytes_ += count * (real_ == CReal::single ? sizeof(float) : sizeof(double));
  }
  void local_floats(std::size_t count) { local_bytes_ += count * sizeof(float); }
  /// Adds functions. Those that they call must have been added before.
  void add(std::string_view text, std::initializer_list<Value> values = {}) {
    functions_ += filled(text, values);
  }

  [[nodiscard]] const CWorkCounts& work() const noexcept { return work_; }
  [[nodiscard]] const std::optional<CWorkCounts>& control_work() const noexcept {
    return control_work_;
  }
  [[nodiscard]] std::size_t local_bytes() const noexcept { return local_bytes_; }
  /// Bytes of the state.
  [[nodiscard]] std::size_t state_bytes() const noexcept { return state_.whole(); }
  [[nodiscard]] const std::string& types() const noexcept { return types_; }
  [[nodiscard]] const std::string& tables() const noexcept { return tables_; }
  /// All functions, those of `c_math` first that they call.
  [[nodiscard]] std::string functions() const;
  /// Bytes of all tables.
  [[nodiscard]] std::size_t table_bytes() const noexcept { return table_bytes_; }

 private:
  /// How a C compiler lays out a struct to which a member is added.
  struct Layout {
    std::size_t bytes = 0;
    std::size_t alignment = 1;
    void add(const Layout& member, std::size_t count);
    /// With the padding at its end.
    [[nodiscard]] std::size_t whole() const noexcept {
      return (bytes + alignment - 1) / alignment * alignment;
    }
  };
  /// Adds a declaration such as "float slip[8]".
  void add_member(Layout& layout, std::string_view declaration) const;
  void add_table(std::string_view type, std::string_view name, std::string_view values,
                 std::size_t count, std::size_t bytes);

  std::string name_;
  CReal real_;
  std::string types_;
  std::string members_;
  std::string tables_;
  std::string functions_;
  std::set<std::string, std::less<>> claimed_;
  std::size_t table_bytes_ = 0;
  Layout state_;
  std::map<std::string, Layout, std::less<>> structs_;
  std::size_t local_bytes_ = 0;
  CWorkCounts work_{};
  std::optional<CWorkCounts> control_work_;
};

}  // namespace torsio
