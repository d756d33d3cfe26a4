#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "torsio/arm/arm_model.hpp"

namespace torsio {

/// A text of a file for a message: short and without control characters.
[[nodiscard]] std::string shown(std::string_view text);

/// The attributes of an XML element, as expat passes them; only valid while expat calls.
class UrdfAttributes {
 public:
  /// @param values names and values in turn, a null pointer after the last one
  UrdfAttributes(std::string_view file, std::size_t line, std::string_view element,
                 const char* const* values)
      : file_(file), line_(line), element_(element), values_(values) {}

  [[nodiscard]] std::size_t line() const { return line_; }
  /// "arm.urdf: line 12: <limit>"
  [[nodiscard]] std::string place() const;

  [[nodiscard]] std::optional<std::string_view> find(std::string_view name) const;
  /// @throws Error if it is missing or empty, as all below if a text is not what it must be
  [[nodiscard]] std::string_view at(std::string_view name) const;
  [[nodiscard]] double number(std::string_view name) const;
  /// Three numbers; `missing` if there is no such attribute.
  [[nodiscard]] Vector3 triple(std::string_view name, const Vector3& missing) const;
  /// The frame of xyz and rpy.
  [[nodiscard]] ArmFrame frame() const;
  /// @throws Error if there is another attribute, but for those of a namespace: a misspelt one
  /// would be a value that is silently 0
  void allow_only(std::span<const std::string_view> names) const;

 private:
  void read(std::string_view name, std::string_view text, std::string_view expected,
            std::span<double> into) const;

  std::string_view file_;
  std::size_t line_;
  std::string_view element_;
  const char* const* values_;
};

}  // namespace torsio
