#include "fit/common/load_leak.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <set>
#include <string_view>
#include <vector>

#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kDeepest = 20;  ///< definitions within definitions; a pipeline has no circles

/// What an input has of the motion of either side.
struct SidesOfInput {
  bool has_joint = false;
  bool has_drive = false;
  bool has_only_speeds = true;
  bool has_lag = false;  ///< with which an expression can form a difference, thus a rate
  bool has_minus = false;
  std::set<std::string_view> drive_sensors = {};

  /// Whether it is the twist between two sensors before the joint, as of the tube before a harmonic drive: each of them
  /// follows the joint, and their difference only the torque.
  [[nodiscard]] bool is_twist_of_drive() const {
    return !has_joint && !has_lag && has_minus && drive_sensors.size() > 1;
  }
  [[nodiscard]] bool is_computation() const {
    return !is_twist_of_drive() && has_joint != has_drive && (!has_only_speeds || has_lag);
  }
};

bool is_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// 0 for an angle, 1 for a speed, 2 for an acceleration; -1 for what is not a motion of one side.
int order_of_channel(std::string_view channel) {
  const auto name = split_channel_name(channel);
  if (!name || name->quantity.find("deflection") != std::string_view::npos) return -1;
  if (name->unit->si_suffix == "rad") return 0;
  if (name->unit->si_suffix == "rad_s") return 1;
  return name->unit->si_suffix == "rad_s2" ? 2 : -1;
}

class InputWalk {
 public:
  explicit InputWalk(const FeatureSpec& spec) : spec_(spec) {}

  /// @param rates that the expression is inside of
  void walk(std::string_view text, int rates, std::size_t depth) {
    std::vector<bool> is_rate;  // one for each open parenthesis
    for (std::size_t at = 0; at < text.size();) {
      if (text[at] == '(') is_rate.push_back(false);
      if (text[at] == ')' && !is_rate.empty()) {
        rates -= is_rate.back() ? 1 : 0;
        is_rate.pop_back();
      }
      if (!is_name(text[at])) {
        found_.has_minus = found_.has_minus || text[at] == '-';
        ++at;
        continue;
      }
      const std::size_t begin = at;
      while (at < text.size() && (is_name(text[at]) || text[at] == '.')) ++at;
      const std::string_view word = text.substr(begin, at - begin);
      if (std::isdigit(static_cast<unsigned char>(word.front())) != 0) continue;
      std::size_t next = at;
      while (next < text.size() && text[next] == ' ') ++next;
      if (next < text.size() && text[next] == '(') {
        is_rate.push_back(word == "rate");
        rates += is_rate.back() ? 1 : 0;
        found_.has_lag = found_.has_lag || word == "lag";
        at = next + 1;
        continue;
      }
      channel(word, rates, depth);
    }
  }
  [[nodiscard]] const SidesOfInput& found() const { return found_; }

 private:
  void channel(std::string_view name, int rates, std::size_t depth) {
    for (const ChannelDefinition& definition : spec_.definitions)
      if (definition.name == name && depth < kDeepest)
        return walk(definition.expression, rates, depth + 1);
    const int order = order_of_channel(name);
    if (order < 0) return;
    (name.starts_with("joint_") ? found_.has_joint : found_.has_drive) = true;
    if (!name.starts_with("joint_")) found_.drive_sensors.insert(name);
    found_.has_only_speeds = found_.has_only_speeds && order + rates == 1;
  }

  const FeatureSpec& spec_;
  SidesOfInput found_;
};

}  // namespace

std::string load_leak(const FeatureSpec& spec) {
  for (const std::string& input : spec.inputs) {
    InputWalk walk(spec);
    walk.walk(input, 0, 0);
    if (walk.found().is_computation()) return input;
  }
  return {};
}

}  // namespace torsio
