#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "torsio/export/c99.hpp"
#include "torsio/export/c_cost.hpp"

namespace torsio {

/// The parts of a C file while it is written. In templates `@` stands for the prefix of all names, `NAME_`, and
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

  /// A table of constants, empty ones excepted. @returns "NAME_table"
  std::string table(std::string_view name, std::span<const double> values);
  std::string float_table(std::string_view name, std::span<const float> values);
  std::string index_table(std::string_view name, std::span<const std::size_t> values);

  /// A member of the state, "float slip[8]" without its semicolon. Zero is its value after a reset.
  void member(std::string_view declaration);
  /// A type that members of the state have, for the header.
  void add_type(std::string_view text) { types_ += filled(text); }
  /// Whether what has this name is still to be written; from now on it is not.
  [[nodiscard]] bool claim(std::string_view what) { return claimed_.emplace(what).second; }
  /// Counts what a step consists of.
  void work(CWork kind, double times = 1.0) { work_[static_cast<std::size_t>(kind)] += times; }
  /// Adds functions. Those that they call must have been added before.
  void add(std::string_view text, std::initializer_list<Value> values = {}) {
    functions_ += filled(text, values);
  }

  [[nodiscard]] const CWorkCounts& work() const noexcept { return work_; }
  /// Bytes of the state.
  [[nodiscard]] std::size_t state_bytes() const noexcept;
  [[nodiscard]] const std::string& types() const noexcept { return types_; }
  [[nodiscard]] const std::string& members() const noexcept { return members_; }
  [[nodiscard]] const std::string& tables() const noexcept { return tables_; }
  /// All functions, those of `c_math` first that they call.
  [[nodiscard]] std::string functions() const;
  /// Bytes of all tables.
  [[nodiscard]] std::size_t table_bytes() const noexcept { return table_bytes_; }

 private:
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
  std::size_t member_bytes_ = 0;
  CWorkCounts work_{};
};

}  // namespace torsio
