#include "check/draft/name_reading.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <utility>
#include <vector>

#include "core/lower.hpp"

namespace torsio {
namespace {

struct QuantityWord {
  std::string_view word;
  Quantity quantity;
  bool is_clear = true;
};

// English and German, the French encoder, and the letters of robotics: q the joint's angle, tau a torque.
constexpr auto kQuantityWords = std::to_array<QuantityWord>({
    {"time", Quantity::time},
    {"timestamp", Quantity::time},
    {"stamp", Quantity::time},
    {"zeit", Quantity::time},
    {"zeitstempel", Quantity::time},
    {"elapsed", Quantity::time},
    {"micros", Quantity::time},
    {"millis", Quantity::time},
    {"clock", Quantity::time},
    {"t", Quantity::time, false},
    {"angle", Quantity::angle},
    {"position", Quantity::angle},
    {"pos", Quantity::angle},
    {"winkel", Quantity::angle},
    {"encoder", Quantity::angle},
    {"enc", Quantity::angle},
    {"theta", Quantity::angle},
    {"q", Quantity::angle, false},
    {"phi", Quantity::angle, false},
    {"velocity", Quantity::speed},
    {"vel", Quantity::speed},
    {"speed", Quantity::speed},
    {"omega", Quantity::speed},
    {"drehzahl", Quantity::speed},
    {"geschwindigkeit", Quantity::speed},
    {"dq", Quantity::speed},
    {"qd", Quantity::speed},
    {"qdot", Quantity::speed},
    {"dtheta", Quantity::speed},
    {"deflection", Quantity::deflection},
    {"defl", Quantity::deflection},
    {"twist", Quantity::deflection},
    {"torsion", Quantity::deflection},
    {"verdrehung", Quantity::deflection},
    {"torque", Quantity::torque},
    {"trq", Quantity::torque},
    {"tq", Quantity::torque},
    {"messwelle", Quantity::torque},
    {"tau", Quantity::torque},
    {"moment", Quantity::torque},
    {"drehmoment", Quantity::torque},
    {"effort", Quantity::torque},
    {"mz", Quantity::torque, false},
    {"force", Quantity::force},
    {"kraft", Quantity::force},
    {"current", Quantity::current},
    {"cur", Quantity::current},
    {"curr", Quantity::current},
    {"strom", Quantity::current},
    {"iq", Quantity::current},
    {"amps", Quantity::current},
    {"i", Quantity::current, false},
    {"voltage", Quantity::voltage},
    {"spannung", Quantity::voltage},
    {"vbus", Quantity::voltage},
    {"temperature", Quantity::temperature},
    {"temp", Quantity::temperature},
    {"temperatur", Quantity::temperature},
    {"duty", Quantity::duty},
    {"pwm", Quantity::duty},
    {"fresh", Quantity::mask},
    {"new", Quantity::mask},
    {"neu", Quantity::mask},
    {"valid", Quantity::mask, false},
    {"updated", Quantity::mask},
    {"error", Quantity::other},
    {"err", Quantity::other},
    {"fault", Quantity::other},
    {"mode", Quantity::other},
    {"state", Quantity::other},
    {"status", Quantity::other},
    {"counter", Quantity::other},
    {"index", Quantity::other},
    {"seq", Quantity::other},
    {"stiffness", Quantity::other},
    {"power", Quantity::other},
    {"acceleration", Quantity::other},
    {"acc", Quantity::other},
    {"ddq", Quantity::other},
    {"covariance", Quantity::other},
    {"std", Quantity::other},
    {"id", Quantity::other},
    {"drehgeber", Quantity::angle},
    {"codeur", Quantity::angle},
    {"geber", Quantity::angle, false},  // the last one: a "Drehmomentgeber" measures a torque
});

constexpr auto kSideWords = std::to_array<std::pair<std::string_view, Side>>({
    {"motor", Side::motor},   {"mot", Side::motor},       {"rotor", Side::motor},
    {"antrieb", Side::motor}, {"m", Side::motor},         {"input", Side::motor},
    {"gear", Side::gear},     {"gearbox", Side::gear},    {"getriebe", Side::gear},
    {"joint", Side::joint},   {"link", Side::joint},      {"load", Side::joint},
    {"output", Side::joint},  {"gelenk", Side::joint},    {"abtrieb", Side::joint},
    {"arm", Side::joint},     {"lever", Side::joint},     {"l", Side::joint},
    {"j", Side::joint},       {"lastseite", Side::joint}, {"last", Side::joint},
});

constexpr auto kGoalWords = std::to_array<std::string_view>(
    {"cmd", "command", "commanded", "goal", "target", "ref", "reference", "desired", "des",
     "setpoint", "soll", "sollwert", "wanted", "demand", "sp"});

constexpr auto kSensorWords = std::to_array<std::string_view>(
    {"sensor", "loadcell", "cell", "meas", "measured", "transducer", "ft", "messwelle"});

constexpr auto kUnitWords = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"deg", "deg"},     {"degree", "deg"},   {"degrees", "deg"}, {"rad", "rad"},
    {"radians", "rad"}, {"turns", "rev"},    {"turn", "rev"},    {"rev", "rev"},
    {"revs", "rev"},    {"rpm", "rpm"},      {"dps", "dps"},     {"ms", "ms"},
    {"msec", "ms"},     {"millis", "ms"},    {"us", "us"},       {"usec", "us"},
    {"micros", "us"},   {"ns", "ns"},        {"nsec", "ns"},     {"sec", "s"},
    {"seconds", "s"},   {"nm", "Nm"},        {"mnm", "mNm"},     {"amps", "A"},
    {"volts", "V"},     {"celsius", "degC"},
});

constexpr auto kCountWords = std::to_array<std::string_view>(
    {"count", "counts", "cnt", "ticks", "tick", "raw", "inc", "increments", "adc", "lsb"});

/// Words in small letters and groups of digits: "motorPos1" is motor, pos, 1.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  char before = ' ';
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const auto is_upper = [](char x) { return std::isupper(static_cast<unsigned char>(x)) != 0; };
    const auto is_lower = [](char x) { return std::islower(static_cast<unsigned char>(x)) != 0; };
    const auto is_digit = [](char x) { return std::isdigit(static_cast<unsigned char>(x)) != 0; };
    const bool is_word = std::isalnum(c) != 0 || c > 127;
    const bool ends_capitals =
        is_upper(name[i]) && is_upper(before) && i + 1 < name.size() && is_lower(name[i + 1]);
    const bool is_start = std::isalnum(static_cast<unsigned char>(before)) == 0 ||
                          (is_upper(name[i]) && is_lower(before)) || ends_capitals ||
                          is_digit(name[i]) != is_digit(before);
    if (is_word && (is_start || words.empty()) && static_cast<unsigned char>(before) < 128)
      words.emplace_back();
    if (is_word) words.back() += name[i];
    before = name[i];
  }
  for (std::string& word : words) word = lower(word);
  return words;
}

/// "i_q" and "q_current" are currents in the axes of the rotor; that of the d axis makes no torque.
void join_axes(std::vector<std::string>& words) {
  for (std::size_t k = 0; k + 1 < words.size(); ++k) {
    const bool is_current = words[k] == "i" && (words[k + 1] == "q" || words[k + 1] == "d");
    const bool is_idle = words[k] == "d" && words[k + 1] == "current";
    if (!is_current && !is_idle) continue;
    words[k] = is_idle ? "id" : "i" + words[k + 1];
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(k) + 1);
  }
}

bool is_one_of(std::span<const std::string_view> words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// A word that contains one, as "motorstrom" does; short ones would be found by chance.
const QuantityWord* contained_quantity(std::string_view word) {
  constexpr std::size_t kLeastLetters = 5;
  const auto* const at = std::ranges::find_if(kQuantityWords, [&](const QuantityWord& each) {
    return each.word.size() >= kLeastLetters && word.find(each.word) != std::string_view::npos;
  });
  return at == kQuantityWords.end() ? nullptr : at;
}

/// The last word that names one, as "torque sensor temperature" is a temperature; a clear one before a letter.
const QuantityWord* quantity_word(const std::vector<std::string>& words) {
  const QuantityWord* found = nullptr;
  for (const std::string& word : words) {
    const auto* at = std::ranges::find(kQuantityWords, word, &QuantityWord::word);
    if (at == kQuantityWords.end() && word.size() > 3 && word.ends_with('s'))  // "torques"
      at = std::ranges::find(kQuantityWords, std::string_view(word).substr(0, word.size() - 1),
                             &QuantityWord::word);
    if (at == kQuantityWords.end()) continue;
    const bool is_weaker = found != nullptr && found->is_clear && !at->is_clear;
    if (!is_weaker) found = at;
  }
  for (std::size_t i = words.size(); i-- > 0 && found == nullptr;)
    found = contained_quantity(words[i]);
  return found;
}

/// The last word that names one: "/joint_states/elbow_motor/position" is of the motor.
Side side_of(const std::vector<std::string>& words) {
  Side side = Side::unknown;
  for (const std::string& word : words)
    if (const auto* const at =
            std::ranges::find(kSideWords, word, &std::pair<std::string_view, Side>::first);
        at != kSideWords.end())
      side = at->second;
  for (const std::string& word : words)
    for (const std::string_view part : {"motor", "moteur", "gelenk", "abtrieb"})
      if (side == Side::unknown && word.find(part) != std::string::npos)
        side = part.starts_with("mot") ? Side::motor : Side::joint;
  return side;
}

bool has_word(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// Words that change what the last one means: the spring's angle is its deflection.
void combine(const std::vector<std::string>& words, NameReading& reading) {
  const bool is_spring = has_word(words, "spring") || has_word(words, "feder");
  const bool is_difference = has_word(words, "delta") || has_word(words, "diff");
  if (reading.quantity == Quantity::angle && (is_spring || is_difference))
    reading.quantity = Quantity::deflection;
  if (reading.quantity == Quantity::unknown && is_spring) reading.quantity = Quantity::deflection;
  if (reading.quantity == Quantity::speed && is_spring)
    reading.quantity = Quantity::deflection_rate;
  if (has_word(words, "rate") || has_word(words, "dot")) {
    if (reading.quantity == Quantity::angle) reading.quantity = Quantity::speed;
    if (reading.quantity == Quantity::deflection) reading.quantity = Quantity::deflection_rate;
    if (reading.quantity == Quantity::torque) reading.quantity = Quantity::other;
  }
  const bool is_load_cell =
      has_word(words, "loadcell") || (has_word(words, "load") && has_word(words, "cell"));
  if (reading.quantity == Quantity::unknown && is_load_cell) {
    reading.quantity = Quantity::torque;
    reading.word = "load cell";
  }
  if (is_load_cell && reading.side == Side::joint) reading.side = Side::unknown;
  if (reading.word == "theta" && reading.side == Side::unknown) reading.side = Side::motor;
  if (reading.word == "q" && reading.side == Side::unknown) reading.side = Side::joint;
}

}  // namespace

NameReading read_name(std::string_view name) {
  std::vector<std::string> words = words_of(name);
  join_axes(words);
  NameReading reading{.side = side_of(words)};
  if (const QuantityWord* const word = quantity_word(words); word != nullptr) {
    reading.quantity = word->quantity;
    reading.is_clear = word->is_clear;
    reading.word = word->word;
  }
  combine(words, reading);
  for (const std::string& word : words) {
    reading.is_goal = reading.is_goal || is_one_of(kGoalWords, word);
    reading.is_sensor = reading.is_sensor || is_one_of(kSensorWords, word);
    reading.is_counted = reading.is_counted || is_one_of(kCountWords, word);
    if (std::isdigit(static_cast<unsigned char>(word.front())) != 0) reading.number = word;
    if (const auto* const unit = std::ranges::find(
            kUnitWords, word, &std::pair<std::string_view, std::string_view>::first);
        unit != kUnitWords.end())
      reading.unit = unit->second;
  }
  return reading;
}

std::string channel_of(Quantity quantity, Side side, bool is_goal) {
  const std::string_view motor = side == Side::motor ? "motor_" : "";
  const std::string_view of_side = side == Side::motor  ? "motor_"
                                   : side == Side::gear ? "gear_"
                                                        : "joint_";
  const std::string goal = is_goal ? "goal_" : "";
  switch (quantity) {
    case Quantity::time: return "t";
    case Quantity::angle: return is_goal ? "goal_angle" : std::string(of_side) + "angle";
    case Quantity::speed: return is_goal ? "goal_speed" : std::string(of_side) + "speed";
    case Quantity::deflection: return goal + "spring_deflection";
    case Quantity::deflection_rate: return goal + "spring_deflection_rate";
    case Quantity::torque: return goal + std::string(motor) + "torque";
    case Quantity::current: return goal + "motor_current";
    case Quantity::voltage: return "drive_supply";
    case Quantity::temperature: return std::string(motor) + "temperature";
    case Quantity::duty: return "duty";
    case Quantity::force: return goal + "force";
    case Quantity::unknown:
    case Quantity::mask:
    case Quantity::other: return {};
  }
  return {};
}

std::string_view si_unit_of(Quantity quantity) noexcept {
  switch (quantity) {
    case Quantity::time: return "s";
    case Quantity::angle:
    case Quantity::deflection: return "rad";
    case Quantity::speed:
    case Quantity::deflection_rate: return "rad_s";
    case Quantity::torque: return "Nm";
    case Quantity::force: return "N";
    case Quantity::current: return "A";
    case Quantity::voltage: return "V";
    case Quantity::temperature: return "K";
    case Quantity::duty:
    case Quantity::mask: return "1";
    case Quantity::unknown:
    case Quantity::other: return {};
  }
  return {};
}

Quantity quantity_of_unit(std::string_view si_unit) noexcept {
  for (const Quantity quantity :
       {Quantity::time, Quantity::angle, Quantity::speed, Quantity::torque, Quantity::force,
        Quantity::current, Quantity::voltage, Quantity::temperature})
    if (si_unit_of(quantity) == si_unit) return quantity;
  return Quantity::unknown;
}

}  // namespace torsio
