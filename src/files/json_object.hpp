#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {

/// One JSON object with its place, for messages.
class JsonObject {
 public:
  /// @param advice what to do about a damaged document; lives longer than the object
  JsonObject(const nlohmann::json& object, std::string place, std::string_view advice)
      : object_(object), place_(std::move(place)), advice_(advice) {
    if (!object_.is_object()) refuse(place_, "an object", object_);
  }

  /// @throws Error naming the first entry that is none of these.
  void allow_only(std::initializer_list<std::string_view> keys) const {
    for (const auto& [key, value] : object_.items())
      if (std::ranges::find(keys, std::string_view(key)) == keys.end())
        throw Error(
            {.place = place_of(key),
             .expected = fmt::format("one of {}", fmt::join(keys, ", ")),
             .found = fmt::format("'{}'", key),
             .advice = did_you_mean(key, std::vector<std::string>(keys.begin(), keys.end()))});
  }

  [[nodiscard]] bool has(const char* key) const { return object_.contains(key); }
  [[nodiscard]] std::string text(const char* key) const {
    return text_of(member(key), place_of(key));
  }
  /// Empty where there is none: a file of an earlier release.
  [[nodiscard]] std::string optional_text(const char* key) const {
    return has(key) ? text(key) : std::string();
  }
  [[nodiscard]] double number(const char* key) const {
    return number_of(member(key), place_of(key));
  }
  [[nodiscard]] bool boolean(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_boolean()) refuse(place_of(key), "true or false", value);
    return value.get<bool>();
  }
  [[nodiscard]] std::uint64_t whole_number(const char* key) const {
    const nlohmann::json& value = member(key);
    if (!value.is_number_unsigned()) refuse(place_of(key), "a whole number from 0", value);
    return value.get<std::uint64_t>();
  }
  [[nodiscard]] std::vector<std::string> texts(const char* key) const {
    std::vector<std::string> result;
    each(key, [&](const nlohmann::json& value, const std::string& place) {
      result.push_back(text_of(value, place));
    });
    return result;
  }
  [[nodiscard]] std::vector<double> numbers(const char* key) const {
    std::vector<double> result;
    each(key, [&](const nlohmann::json& value, const std::string& place) {
      result.push_back(number_of(value, place));
    });
    return result;
  }
  /// One `read(JsonObject)` for each object of a list.
  template <class Read>
  [[nodiscard]] auto objects(const char* key, Read read) const {
    std::vector<decltype(read(*this))> result;
    each(key, [&](const nlohmann::json& value, const std::string& place) {
      result.push_back(read(JsonObject(value, place, advice_)));
    });
    return result;
  }
  /// read(JsonObject) for an object of this one.
  template <class Read>
  [[nodiscard]] auto object(const char* key, Read read) const {
    return read(JsonObject(member(key), place_of(key), advice_));
  }
  [[nodiscard]] std::map<std::string, std::string> text_map(const char* key) const {
    return map<std::string>(key, &JsonObject::text_of);
  }
  [[nodiscard]] std::map<std::string, double> number_map(const char* key) const {
    return map<double>(key, &JsonObject::number_of);
  }

 private:
  [[noreturn]] void refuse(const std::string& place, std::string expected,
                           const nlohmann::json& found) const {
    throw Error({.place = place,
                 .expected = std::move(expected),
                 .found = found.is_structured() ? found.type_name() : found.dump(),
                 .advice = std::string(advice_)});
  }
  [[nodiscard]] std::string text_of(const nlohmann::json& value, const std::string& place) const {
    if (!value.is_string()) refuse(place, "a text", value);
    return value.get<std::string>();
  }
  /// JSON has no NaN: it is written as null.
  [[nodiscard]] double number_of(const nlohmann::json& value, const std::string& place) const {
    if (value.is_null()) return kNotMeasured;
    if (!value.is_number()) refuse(place, "a number", value);
    return value.get<double>();
  }

  [[nodiscard]] std::string place_of(std::string_view key) const {
    return fmt::format("{}/{}", place_, key);
  }
  [[nodiscard]] const nlohmann::json& member(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end())
      throw Error({.place = place_of(key),
                   .expected = "an entry",
                   .found = "none",
                   .advice = std::string(advice_)});
    return *found;
  }
  template <class Visit>
  void each(const char* key, Visit visit) const {
    const nlohmann::json& list = member(key);
    if (!list.is_array()) refuse(place_of(key), "a list", list);
    for (std::size_t i = 0; i < list.size(); ++i)
      visit(list[i], fmt::format("{}/{}", place_of(key), i));
  }
  template <class T, class Read>
  std::map<std::string, T> map(const char* key, Read read) const {
    const nlohmann::json& entries = member(key);
    if (!entries.is_object()) refuse(place_of(key), "an object", entries);
    std::map<std::string, T> result;
    for (const auto& [name, value] : entries.items())
      result[name] = (this->*read)(value, fmt::format("{}/{}", place_of(key), name));
    return result;
  }

  const nlohmann::json& object_;
  std::string place_;
  std::string_view advice_;
};

}  // namespace torsio
