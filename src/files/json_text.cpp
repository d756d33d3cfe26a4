#include "files/json_text.hpp"

#include <fmt/format.h>

#include <set>
#include <string>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using nlohmann::json;

constexpr int kDeepest = 8;

}  // namespace

json parse_json(std::string_view text, std::string_view place) {
  std::vector<std::set<std::string>> open_keys;  // keys of every object and array around the cursor
  // The library accepts deep nesting and keys that come twice without an error.
  const auto check = [&](int depth, json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        if (depth >= kDeepest)
          throw Error({.place = std::string(place),
                       .expected = fmt::format("at most {} levels of nesting", kDeepest),
                       .found = "more"});
        open_keys.emplace_back();
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end: open_keys.pop_back(); break;
      case json::parse_event_t::key:
        if (!open_keys.back().insert(parsed.get<std::string>()).second)
          throw Error({.place = std::string(place),
                       .expected = "each key once",
                       .found = parsed.dump() + " twice"});
        break;
      case json::parse_event_t::value: break;
    }
    return true;
  };
  try {
    return json::parse(text, check);
  } catch (const json::parse_error& error) {
    throw Error({.place = std::string(place),
                 .expected = "JSON",
                 .found = fmt::format("something else at byte {}", error.byte),
                 .advice = "The file is damaged: copy it again or fit the model again."});
  } catch (const json::out_of_range&) {
    throw Error({.place = std::string(place),
                 .expected = "numbers that a double can hold",
                 .found = "a larger one"});
  }
}

}  // namespace torsio
