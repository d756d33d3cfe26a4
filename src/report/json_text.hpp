#pragma once

#include <string>

namespace torsio {

/// `schema_version`, the first key of every JSON document that the program and the library write.
/// It rises when a reader of an older document could misread a newer one (docs/use/json.md).
inline constexpr int kJsonSchemaVersion = 1;

/// An object as text, `schema_version` before its own keys.
/// @tparam Json nlohmann::ordered_json, which this header does not include: users of the library
/// need not have it.
template <class Json>
[[nodiscard]] std::string json_text(const Json& document) {
  Json versioned{{"schema_version", kJsonSchemaVersion}};
  versioned.update(document);
  // A name of a file need not be UTF-8.
  return versioned.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace torsio
