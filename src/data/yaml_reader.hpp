#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"

namespace torsio {

/// A text without control characters in double quotes; `YamlValue::text` gives its bytes again.
[[nodiscard]] std::string yaml_quoted(std::string_view text);

/// A YAML value with its place, so that every message names file, line and key.
class YamlValue {
 public:
  /// @throws Error if the text is not YAML or too large.
  static YamlValue parse(std::string_view text, const std::string& file);
  static YamlValue read(const std::string& path, const Progress& progress = {});

  /// The same with other texts in the place of `{name}`, wherever that is in a scalar of it.
  [[nodiscard]] YamlValue replaced(std::map<std::string, std::string> texts) const;

  [[nodiscard]] std::string place() const;
  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  [[nodiscard]] bool is_map() const { return node_.IsMap(); }
  [[nodiscard]] bool is_list() const { return node_.IsSequence(); }
  [[nodiscard]] bool is_scalar() const { return node_.IsScalar(); }

  /// Key and value of a map, in file order. @throws Error if this is not a map or a key is
  /// repeated.
  [[nodiscard]] std::vector<std::pair<std::string, YamlValue>> entries() const;
  /// @throws Error for a key that is not listed, with the nearest one that is.
  void allow_only(std::initializer_list<std::string_view> keys) const;
  void allow_only(std::span<const std::string> known) const;
  [[nodiscard]] std::optional<YamlValue> find(std::string_view wanted) const;
  [[nodiscard]] YamlValue at(std::string_view key) const;  ///< @throws Error if missing

  [[nodiscard]] std::vector<YamlValue> items()
      const;  ///< items of a list; a scalar is a list of one
  [[nodiscard]] std::vector<std::string> texts() const;
  /// The same where a text may be empty.
  [[nodiscard]] std::vector<std::string> texts_or_empty() const;
  [[nodiscard]] std::string text() const;
  /// A number in the SI unit, which may carry another unit of the same quantity.
  [[nodiscard]] double number(std::string_view si_unit = "1") const;
  /// A number without a unit, where the key or another entry states it. @throws Error also if it is
  /// larger than `largest`.
  [[nodiscard]] double plain_number(double largest) const;
  /// A number without a unit, or a fraction: "1/150".
  [[nodiscard]] double factor() const;
  [[nodiscard]] double positive_number(std::string_view si_unit) const;
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] bool boolean() const;

  [[noreturn]] void refuse(const std::string& expected, const std::string& advice = {}) const;

 private:
  using Replacements = std::shared_ptr<const std::map<std::string, std::string>>;

  YamlValue(const YAML::Node& node, std::string file, std::string path,
            Replacements replacements = {})
      : node_(node),
        file_(std::move(file)),
        path_(std::move(path)),
        replacements_(std::move(replacements)) {}
  [[nodiscard]] std::string scalar() const;

  YAML::Node node_;
  std::string file_;
  std::string path_;  ///< keys down to here: "clock.rebuild"
  Replacements replacements_;
};

}  // namespace torsio
