#include "data/bam/bam_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "data/names.hpp"
#include "data/read_all.hpp"
#include "data/read_budget.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr const char* kBamLayout =
    "a log of BAM: {\"mass\": .., \"length\": .., \"kp\": .., \"vin\": .., \"motor\": .., "
    "\"trajectory\": .., \"entries\": [{\"timestamp\": .., \"position\": .., ..}, ..]}";
constexpr double kBamRate_Hz = 200.0;  // BAM's own step of 5 ms

/// A number of the header, and the condition that it is.
struct BamFact {
  std::string_view key;
  std::string_view condition;
};

constexpr auto kBamFacts = std::to_array<BamFact>({{"mass", "mass_kg"},
                                                   {"arm_mass", "arm_mass_kg"},
                                                   {"arm-mass", "arm_mass_kg"},
                                                   {"length", "length_m"},
                                                   {"kp", "kp_1"},
                                                   {"vin", "supply_V"}});
constexpr std::array<std::string_view, 2> kBamLabels{"motor", "trajectory"};

/// A field of an entry, and the column that it is.
struct BamField {
  std::string_view key;
  std::string_view column;
};

constexpr auto kBamFields = std::to_array<BamField>({{"timestamp", "t_s"},
                                                     {"position", "joint_angle_rad"},
                                                     {"speed", "joint_speed_rad_s"},
                                                     {"goal_position", "goal_angle_rad"},
                                                     {"load", "load_1"},
                                                     {"input_volts", "drive_supply_V"},
                                                     {"temp", "temperature_degC"},
                                                     {"torque_enable", "enabled_1"}});
constexpr std::size_t kRequiredFields = 2;  // the first fields of this list
constexpr std::string_view kLoadColumn = "load_1";
constexpr std::string_view kEnabledColumn = "enabled_1";

/// Takes numbers and texts as the parser meets them: a document would need many times the memory of the text.
class BamEvents final : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit BamEvents(ReadBudget& budget) : budget_(budget) {}

  std::array<std::vector<double>, kBamFields.size()> values = {};
  std::vector<std::pair<std::string, double>> conditions = {};
  std::vector<std::pair<std::string, std::string>> labels = {};
  std::set<std::string> other_names = {};  ///< what is not read
  std::size_t entries = 0;
  bool has_entries = false;

  bool null() override { return number(kNotMeasured, "null"); }
  bool boolean(bool value) override { return number(value ? 1.0 : 0.0, value ? "true" : "false"); }
  bool number_integer(number_integer_t value) override {
    return number(static_cast<double>(value), {});
  }
  bool number_unsigned(number_unsigned_t value) override {
    return number(static_cast<double>(value), {});
  }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return number(value, {});
  }
  bool string(string_t& value) override;
  bool binary(binary_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*size*/) override { return open(true); }
  bool start_array(std::size_t /*size*/) override { return open(false); }
  bool end_object() override {
    if (depth_ == kEntry && is_in_entries_) end_entry();
    --depth_;
    return true;
  }
  bool end_array() override {
    if (--depth_ == kHeader) is_in_entries_ = false;
    return true;
  }
  bool key(string_t& name) override;
  bool parse_error(std::size_t byte, const std::string& token,
                   const nlohmann::detail::exception& error) override;

 private:
  static constexpr std::size_t kHeader = 1;   ///< depth within the object of the log
  static constexpr std::size_t kEntries = 2;  ///< within the list
  static constexpr std::size_t kEntry = 3;    ///< within one of its objects
  static constexpr std::size_t kDeepest = 8;

  bool open(bool is_object);
  bool number(double value, std::string_view word);
  void end_entry();
  [[nodiscard]] std::string place() const {
    if (!is_in_entries_) return fmt::format("{}: {}", budget_.name(), printable(key_));
    return fmt::format("{}: entry {}, {}", budget_.name(), entries + 1, printable(key_));
  }
  [[noreturn]] void refuse(std::string expected, std::string found) const {
    throw Error({.place = place(), .expected = std::move(expected), .found = std::move(found)});
  }

  ReadBudget& budget_;
  std::string key_;
  std::optional<std::size_t> field_;  ///< that has the name `key_`
  std::size_t depth_ = 0;
  bool is_in_entries_ = false;
};

bool BamEvents::key(string_t& name) {
  budget_.work(1);
  if (depth_ > kEntry || (depth_ > kHeader && !is_in_entries_)) return true;
  key_ = name;
  if (depth_ != kEntry) return true;
  const auto* const at = std::ranges::find(kBamFields, std::string_view(name), &BamField::key);
  field_.reset();
  if (at == kBamFields.end()) {
    if (other_names.insert(name).second) budget_.keep(name.size() + sizeof(std::string));
    return true;
  }
  field_ = static_cast<std::size_t>(at - kBamFields.begin());
  if (values[*field_].size() > entries) refuse("each field once", "it twice");
  return true;
}

bool BamEvents::open(bool is_object) {
  budget_.work(1);
  if (depth_ >= kDeepest)
    throw Error({.place = budget_.name(),
                 .expected = fmt::format("at most {} levels of nesting", kDeepest),
                 .found = "more"});
  if (depth_ == 0 && !is_object)
    throw Error({.place = budget_.name(), .expected = kBamLayout, .found = "a list"});
  if (depth_ == kHeader && key_ == "entries") {
    if (is_object) refuse("a list", "an object");
    if (has_entries) refuse("each key once", "it twice");
    is_in_entries_ = has_entries = true;
  } else if (depth_ == kEntries && is_in_entries_) {
    if (!is_object) refuse("an object for each sample", "a list");
  } else if (depth_ == kEntry && is_in_entries_ && field_) {
    refuse("a number", is_object ? "an object" : "a list");
  }
  ++depth_;
  return true;
}

bool BamEvents::string(string_t& value) {
  budget_.work(1);
  if (is_in_entries_ && depth_ <= kEntry && (depth_ == kEntries || field_))
    refuse(depth_ == kEntries ? "an object for each sample" : "a number",
           "'" + printable(value) + "'");
  if (depth_ != kHeader) return true;
  if (std::ranges::find(kBamFacts, std::string_view(key_), &BamFact::key) != kBamFacts.end())
    refuse("a number", "'" + printable(value) + "'");
  if (key_ == "entries") refuse("a list", "a text");
  if (std::ranges::find(kBamLabels, std::string_view(key_)) == kBamLabels.end()) return true;
  if (std::ranges::any_of(labels, [&](const auto& label) { return label.first == key_; }))
    refuse("each key once", "it twice");
  labels.emplace_back(key_, printable(value));
  return true;
}

bool BamEvents::number(double value, std::string_view word) {
  budget_.work(1);
  const std::string found = word.empty() ? fmt::format("{}", value) : std::string(word);
  if (is_in_entries_ && depth_ == kEntries) refuse("an object for each sample", found);
  if (is_in_entries_ && depth_ == kEntry && field_) {
    const bool is_enabled = kBamFields[*field_].column == kEnabledColumn;
    if (is_enabled && value != 0.0 && value != 1.0) refuse("true or false", found);
    if (!is_enabled && !word.empty() && word != "null") refuse("a number", found);
    if (*field_ < kRequiredFields && std::isnan(value)) refuse("a number", found);
    budget_.keep(sizeof(double));
    values[*field_].push_back(value);
    return true;
  }
  if (depth_ == 0) throw Error({.place = budget_.name(), .expected = kBamLayout, .found = found});
  if (depth_ != kHeader) return true;
  if (key_ == "entries") refuse("a list", found);
  const auto* const fact = std::ranges::find(kBamFacts, std::string_view(key_), &BamFact::key);
  if (fact == kBamFacts.end()) return true;
  if (!word.empty()) refuse("a number", found);
  const std::string name(fact->condition);
  if (std::ranges::any_of(conditions, [&](const auto& made) { return made.first == name; }))
    refuse("each fact once", "it twice");
  conditions.emplace_back(name, value);
  return true;
}

/// A field that the first entry has must be in every other one, and no other.
void BamEvents::end_entry() {
  for (std::size_t i = 0; i < kBamFields.size(); ++i) {
    const std::size_t size = values[i].size();
    const bool is_required = i < kRequiredFields;
    if (size == entries + 1 || (size == 0 && !is_required)) continue;
    key_ = kBamFields[i].key;
    if (size <= 1 && !is_required) refuse("the fields of the first entry", "a further one");
    refuse("a number", "none");
  }
  ++entries;
  field_.reset();
}

bool BamEvents::parse_error(std::size_t byte, const std::string& /*token*/,
                            const nlohmann::detail::exception& error) {
  if (dynamic_cast<const nlohmann::json::out_of_range*>(&error) != nullptr)
    refuse("numbers that a double can hold", "a larger one");
  throw Error(
      {.place = fmt::format("{}: byte {}", budget_.name(), byte),
       .problem =
           entries > 0
               ? fmt::format("after {} whole entries the text is not JSON, or it ends too early",
                             entries)
               : "the text is not JSON, or it ends too early",
       .expected = kBamLayout,
       .advice = "Copy the file again; NaN and Infinity, as Python writes them, are not "
                 "JSON: write null."});
}

/// What the numbers of `load` are.
struct LoadScale {
  double full = 0.0;  ///< 0: not known
  std::string note = {};
};

LoadScale scale_of_load(const std::vector<double>& load, std::string_view motor) {
  constexpr double kFullPwm = 885.0;  // XL330, e-manual of Robotis: PWM limit
  double largest = 0.0;
  bool has_fractions = false;
  for (const double value : load) {
    if (std::isnan(value)) continue;
    largest = std::max(largest, std::abs(value));
    has_fractions = has_fractions || value != std::round(value);
  }
  if (largest == 0.0) return {.full = 1.0};
  if (largest <= 1.0 && has_fractions)
    return {.full = 1.0, .note = "load is read as a duty, since it is within -1 and 1"};
  if (motor.starts_with("xl330") || largest == kFullPwm)
    return {.full = kFullPwm,
            .note = fmt::format("load is read as a PWM with {} at full duty", kFullPwm)};
  return {
      .note = fmt::format(
          "load is channel load_1, as in the file: the full scale for motor '{}' is not known, the "
          "largest number is {:g}; where FULL is that of full duty, write in a mapping  derive: "
          "{{duty_1: load_1/FULL}}",
          motor, largest)};
}

/// The load as a duty. Recorders of BAM write a negative PWM as the two's complement of 16 bits.
void decode_load(LogColumn& load, std::string_view motor, std::vector<std::string>& notes) {
  constexpr double kSign = 32768.0;
  constexpr double kModulus = 65536.0;
  for (double& value : load.values)
    if (value >= kSign && value < kModulus) value -= kModulus;
  LoadScale scale = scale_of_load(load.values, motor);
  if (!scale.note.empty()) notes.push_back(std::move(scale.note));
  if (!(scale.full > 0.0)) return;
  load.name = "duty_1";
  for (double& value : load.values) value /= scale.full;
}

std::string label_of(const BamEvents& events, std::string_view name) {
  const auto at =
      std::ranges::find(events.labels, name, &std::pair<std::string, std::string>::first);
  return at == events.labels.end() ? std::string() : at->second;
}

/// "sin_sin_kp400"; empty where the log has no trajectory.
std::string name_of_run(const BamEvents& events) {
  std::string trajectory = label_of(events, "trajectory");
  const auto kp =
      std::ranges::find(events.conditions, "kp_1", &std::pair<std::string, double>::first);
  if (trajectory.empty() || kp == events.conditions.end()) return trajectory;
  return fmt::format("{}_kp{:g}", trajectory, kp->second);
}

LogTable table_of(BamEvents events, const std::string& name) {
  const auto has = [&](std::string_view condition) {
    return std::ranges::find(events.conditions, condition,
                             &std::pair<std::string, double>::first) != events.conditions.end();
  };
  if (has("mass_kg") && !has("arm_mass_kg")) events.conditions.emplace_back("arm_mass_kg", 0.0);
  LogTable table;
  table.source.file = name;
  table.row_word = "entry";
  table.line_marks.emplace_back(0, 1);
  table.recording_name = name_of_run(events);
  table.resample_Hz = kBamRate_Hz;
  for (std::size_t i = 0; i < kBamFields.size(); ++i) {
    if (events.values[i].empty()) continue;
    LogColumn& column = table.columns.emplace_back();
    column.name = kBamFields[i].column;
    column.number = table.columns.size();
    column.values = std::move(events.values[i]);
    // Power is on or off, also between two samples: it is held and not interpolated.
    if (column.name == kEnabledColumn) column.fresh.assign(column.values.size(), 1);
    if (column.name == kLoadColumn) decode_load(column, label_of(events, "motor"), table.notes);
  }
  const std::vector<std::string> others(events.other_names.begin(), events.other_names.end());
  if (!others.empty())
    table.notes.push_back("fields of entries that are not read: " + listed(others, 8));
  table.conditions = std::move(events.conditions);
  table.labels = std::move(events.labels);
  return table;
}

}  // namespace

bool is_bam_log(std::string_view start) noexcept {
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && start[first] == '{' &&
         start.find("\"entries\"", first) != std::string_view::npos;
}

LogTable read_bam_log(ByteSource& source, const std::string& name, const Progress& progress) {
  ReadBudget budget(name, progress);
  const std::string text = read_all(source, budget);
  budget.keep(text.size());
  BamEvents events(budget);
  nlohmann::json::sax_parse(text, &events);
  if (!events.has_entries || events.entries == 0)
    throw Error({.place = name,
                 .expected = kBamLayout,
                 .found = events.has_entries ? "a list without entries" : "no list of entries"});
  return table_of(std::move(events), name);
}

}  // namespace torsio
