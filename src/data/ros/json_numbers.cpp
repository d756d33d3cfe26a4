#include "data/ros/json_numbers.hpp"

#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

#include "data/names.hpp"

namespace torsio {
namespace {

constexpr std::size_t kDeepestJson = 64;

/// Sets the numbers as the parser meets them: a document would need many times the memory of the text.
class NumberSetter final : public nlohmann::json_sax<nlohmann::json> {
 public:
  NumberSetter(const std::string& topic, TopicTable& table, ReadBudget& budget)
      : name_(topic), table_(table), budget_(budget) {}

  bool null() override { return set(kNotMeasured); }
  bool boolean(bool value) override { return set(value ? 1.0 : 0.0); }
  bool number_integer(number_integer_t value) override { return set(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return set(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return set(value); }
  bool string(string_t& /*value*/) override { return begin_value(); }
  bool binary(binary_t& /*value*/) override { return begin_value(); }
  bool start_object(std::size_t /*size*/) override { return open(false); }
  bool start_array(std::size_t /*size*/) override { return open(true); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    append(escaped(name));
    return true;
  }
  bool parse_error(std::size_t /*byte*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return false;
  }

 private:
  struct Level {
    std::size_t name_bytes = 0;  ///< length of the name of the object or list
    bool is_list = false;
    std::size_t next = 0;  ///< index of the next element
  };

  void append(const std::string& part) {
    name_.resize(levels_.back().name_bytes);
    name_ += '/';
    name_ += part;
  }
  /// The name is then that of the value that follows.
  bool begin_value() {
    constexpr std::size_t kNameBytes = 64;  // a search compares all of a longer name
    budget_.work(1 + name_.size() / kNameBytes);
    if (!levels_.empty() && levels_.back().is_list) append(std::to_string(levels_.back().next++));
    return true;
  }
  bool set(double value) {
    begin_value();
    table_.set(table_.column(name_, budget_), value);
    return true;
  }
  bool open(bool is_list) {
    begin_value();
    if (levels_.size() >= kDeepestJson) return false;
    levels_.push_back({.name_bytes = name_.size(), .is_list = is_list});
    return true;
  }
  bool close() {
    levels_.pop_back();
    return true;
  }

  std::string name_;
  TopicTable& table_;
  ReadBudget& budget_;
  std::vector<Level> levels_;
};

}  // namespace

bool set_json_numbers(std::string_view message, const std::string& topic, TopicTable& table,
                      ReadBudget& budget) {
  NumberSetter setter(topic, table, budget);
  return nlohmann::json::sax_parse(message, &setter);
}

}  // namespace torsio
