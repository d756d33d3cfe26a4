#include "files/json_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using nlohmann::json;

constexpr std::size_t kDeepest = 8;

/// Builds the document event by event. The parser of the library accepts deep nesting and keys that
/// come twice, and with a callback it searches the parent's entries after each object.
class DocumentBuilder final : public nlohmann::json_sax<json> {
 public:
  DocumentBuilder(std::string_view place, std::string_view advice)
      : place_(place), advice_(advice) {}

  [[nodiscard]] json take() { return std::move(document_); }

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t& value) override { return add(std::move(value)); }
  bool start_object(std::size_t /*size*/) override { return open(json::object()); }
  bool start_array(std::size_t /*size*/) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    const auto [at, is_new] = open_.back()->get_ref<json::object_t&>().emplace(name, nullptr);
    if (!is_new)
      throw Error({.place = std::string(place_),
                   .expected = "each key once",
                   .found = json(name).dump() + " twice"});
    next_ = &at->second;
    return true;
  }

  bool parse_error(std::size_t byte, const std::string& /*token*/,
                   const nlohmann::detail::exception& error) override {
    if (dynamic_cast<const json::out_of_range*>(&error) != nullptr)
      throw Error({.place = std::string(place_),
                   .expected = "numbers that a double can hold",
                   .found = "a larger one"});
    throw Error({.place = std::string(place_),
                 .expected = "JSON",
                 .found = fmt::format("something else at byte {}", byte),
                 .advice = std::string(advice_)});
  }

 private:
  /// The place of the next value: the whole, a key's value or the end of a list.
  json& next() {
    if (open_.empty()) return document_;
    if (open_.back()->is_object()) return *next_;
    return open_.back()->emplace_back();
  }
  bool add(json value) {
    next() = std::move(value);
    return true;
  }
  bool open(json value) {
    if (open_.size() >= kDeepest)
      throw Error({.place = std::string(place_),
                   .expected = fmt::format("at most {} levels of nesting", kDeepest),
                   .found = "more"});
    json& at = next();
    at = std::move(value);
    open_.push_back(&at);  // remains where it is: its parent gets no other value before its end
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  std::string_view place_;
  std::string_view advice_;
  json document_;
  std::vector<json*> open_;
  json* next_ = nullptr;
};

}  // namespace

json parse_json(std::string_view text, std::string_view place, std::string_view advice) {
  DocumentBuilder builder(place, advice);
  (void)json::sax_parse(text, &builder);
  return builder.take();
}

nlohmann::ordered_json json_number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace torsio
