#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// One setting of a fitter, for `--help`, the checks and later tuning. Options structs declare it
/// next to their fields (`fit/common/option_fields.hpp`), from which the tables are made.
struct OptionInfo {
  enum class Kind { number, integer, boolean, text, choice };
  std::string_view name;
  Kind kind = Kind::number;
  std::string_view default_value = {};  ///< "auto": the fitter determines it
  double minimum = 0.0;                 ///< numbers and integers only
  double maximum = 0.0;
  std::string_view help = {};
  std::span<const std::string_view> choices = {};  ///< for `Kind::choice`
  bool takes_auto = false;  ///< `auto` may be given though it is not the default
};

/// Range or choices as help lists them: " (0 to 1)", " (adam, adamw)"; empty for other kinds.
[[nodiscard]] std::string range_of(const OptionInfo& option);

/// Settings of one fit as given by the user (`--set name=value`), checked against a family's table.
class Options {
 public:
  /// @throws UsageError for an unknown name (listing the known ones), a value of the wrong kind or
  /// out of range.
  Options(std::span<const OptionInfo> known, const std::map<std::string, std::string>& given);

  /// Each @throws Error if the table has no such option. A number that is `auto` is NaN.
  [[nodiscard]] double number(std::string_view name) const;
  [[nodiscard]] std::size_t integer(std::string_view name) const;
  [[nodiscard]] bool boolean(std::string_view name) const;
  [[nodiscard]] const std::string& text(std::string_view name) const;

  /// Every setting with its value, defaults included: stored in a model's card.
  [[nodiscard]] std::map<std::string, std::string> values() const {
    return {values_.begin(), values_.end()};
  }

 private:
  std::map<std::string, std::string, std::less<>> values_;
};

}  // namespace torsio
