#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "actuator/second_stage.hpp"
#include "core/checks.hpp"
#include "core/quantity.hpp"
#include "core/text_cursor.hpp"
#include "core/trimmed.hpp"
#include "data/names.hpp"
#include "sim/faults/fault_rules.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

// The short form of one fault.

namespace torsio {
namespace {

constexpr double kStopTimes = 10.0;  // stiffness of a stop over the spring's
constexpr std::string_view kForm =
    "WHAT=AMOUNT@TIME or WHAT=KIND:AMOUNT@TIME, as kt=-20%@3s, "
    "gear_angle=1deg@2s or motor_angle=freeze@2s..4s";

/// A name that people may write, and the sensor or part.
struct Target {
  std::string written;
  std::string what;
};

std::vector<Target> targets(const DataSheet& sheet) {
  std::vector<Target> all;
  for (const SensedChannel& channel : sensed_channels(sheet)) {
    all.push_back({std::string(channel.name), std::string(channel.name)});
    const auto parts = split_channel_name(channel.name);
    if (parts) all.push_back({std::string(parts->quantity), std::string(channel.name)});
    if (channel.value == &Measurement::motor_current_A)
      all.push_back({"current", std::string(channel.name)});
  }
  const std::vector<std::string> parts = fault_parts(sheet);
  for (const std::string& part : parts) all.push_back({part, part});
  all.push_back({"spring", parts.front()});
  all.push_back({"kt", "torque-constant"});
  return all;
}

class InjectionText {
 public:
  InjectionText(std::string_view text, const DataSheet& sheet) : text_(text), sheet_(sheet) {}

  ScheduledFault read() const {
    const std::size_t equals = text_.find('=');
    const std::size_t at = text_.rfind('@');
    if (equals == std::string_view::npos || at == std::string_view::npos || at < equals)
      refuse(kForm, text_);
    ScheduledFault fault{.what = target(trimmed(text_.substr(0, equals))), .place = place()};
    read_times(trimmed(text_.substr(at + 1)), fault);
    read_effect(trimmed(text_.substr(equals + 1, at - equals - 1)), fault);
    check_fault(fault, sheet_, std::numeric_limits<double>::infinity());
    return fault;
  }

 private:
  [[nodiscard]] std::string place() const { return fmt::format("fault '{}'", printable(text_)); }
  [[noreturn]] void refuse(std::string_view expected, std::string_view found,
                           std::string_view advice = {}) const {
    torsio::refuse<UsageError>(place(), expected, fmt::format("'{}'", printable(found)), advice);
  }

  [[nodiscard]] std::string target(std::string_view written) const {
    const std::vector<Target> all = targets(sheet_);
    const auto found = std::ranges::find(all, written, &Target::written);
    if (found != all.end()) return found->what;
    std::vector<std::string> names;
    for (const Target& of : all)
      if (std::ranges::find(names, of.written) == names.end()) names.push_back(of.written);
    refuse(fmt::format("a sensor or part of {}: {}", sheet_.name, joined(names)), written,
           did_you_mean(written, names));
  }

  void read_times(std::string_view times, ScheduledFault& fault) const {
    const std::size_t dots = times.find("..");
    fault.start_s = signed_quantity_with_unit(times.substr(0, dots), "s", place() + ": time");
    if (dots == std::string_view::npos) return;
    const double end_s = signed_quantity_with_unit(times.substr(dots + 2), "s", place() + ": end");
    if (!(end_s > fault.start_s)) refuse("an end after the start", times);
    fault.duration_s = end_s - fault.start_s;
  }

  void read_effect(std::string_view effect, ScheduledFault& fault) const {
    const std::string_view part = common_part_name(fault.what, sheet_);
    const std::size_t colon = effect.find(':');
    std::string_view kind = trimmed(effect.substr(0, colon));
    std::string_view amount =
        colon == std::string_view::npos ? std::string_view{} : trimmed(effect.substr(colon + 1));
    const FaultRule* rule = find_fault_rule(kind, part);
    if (rule == nullptr && colon == std::string_view::npos) {
      amount = effect;
      rule = default_rule(effect, part);
    }
    if (rule == nullptr) {
      const std::vector<std::string> names = fault_names(part);
      refuse("an amount, or one of " + joined(names), kind, did_you_mean(kind, names));
    }
    fault.kind = rule->kind;
    read_amount(amount, *rule, fault);
  }

  /// The rule for an amount without a kind. Null if it is not a number.
  [[nodiscard]] static const FaultRule* default_rule(std::string_view amount,
                                                     std::string_view part) {
    const bool is_number = !amount.empty() && (amount.front() == '-' || amount.front() == '+' ||
                                               amount.front() == '.' || is_digit(amount.front()));
    if (!is_number) return nullptr;
    if (part.empty())
      return find_fault_rule(amount.back() == '%' ? FaultKind::gain : FaultKind::jump, part);
    return find_fault_rule(part == "spring" ? FaultKind::broken : FaultKind::drift, part);
  }

  void read_amount(std::string_view amount, const FaultRule& rule, ScheduledFault& fault) const {
    if (rule.amount_key.empty()) {
      if (!amount.empty()) refuse(fmt::format("'{}' without an amount", rule.name), amount);
      return;
    }
    if (rule.kind == FaultKind::bottom)
      fault.stop_stiffness_Nm_rad = kStopTimes * second_stage_stiffness(sheet_);
    if (amount.empty()) {
      if (rule.kind == FaultKind::wrap) fault.amount = 1.0;
      if (rule.kind == FaultKind::wrap || rule.kind == FaultKind::broken) return;
      refuse(fmt::format("an amount, '{}:...'", rule.name), rule.name);
    }
    if (rule.amount_unit == "1") {
      fault.amount = rule.kind == FaultKind::wrap ? number(amount) : factor(amount);
      return;
    }
    const std::string_view unit =
        rule.amount_unit.empty() ? split_channel_name(fault.what)->unit->suffix : rule.amount_unit;
    fault.amount = signed_quantity_with_unit(without_plus(amount), unit, place());
  }

  [[nodiscard]] static std::string_view without_plus(std::string_view text) {
    return text.starts_with('+') ? text.substr(1) : text;
  }

  [[nodiscard]] double number(std::string_view text) const {
    const std::string_view digits = without_plus(text);
    const NumberText number = leading_number(digits);
    if (!number.fits || number.text != digits)
      refuse("a number, or a change in per cent with its sign", text);
    return number.value;
  }

  /// "-20%" and "0.8" are the same factor.
  [[nodiscard]] double factor(std::string_view text) const {
    if (!text.ends_with('%')) return number(text);
    if (!text.starts_with('-') && !text.starts_with('+'))
      refuse("a change with its sign, -20%, or a factor, 0.8", text);
    return 1.0 + number(text.substr(0, text.size() - 1)) / 100.0;
  }

  std::string_view text_;
  const DataSheet& sheet_;
};

}  // namespace

ScheduledFault parse_injection(std::string_view text, const DataSheet& sheet) {
  return InjectionText(text, sheet).read();
}

}  // namespace torsio
