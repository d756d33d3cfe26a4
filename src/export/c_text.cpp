#include "export/c_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>

#include "export/c_math.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// With a point or an exponent, which a literal of this type needs.
std::string with_point(std::string digits) {
  if (digits.find_first_of(".en") == std::string::npos) digits += ".0";
  return digits;
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

constexpr std::size_t kPerLine = 6;

}  // namespace

std::string CText::float_number(double value, std::string_view what) {
  if (!(std::abs(value) <= static_cast<double>(FLT_MAX)))
    throw Error(
        {.place = std::string(what.empty() ? "a number of the model" : what),
         .expected = "a finite number that a float holds",
         .found = fmt::format("{}", value),
         .advice =
             "--real double holds larger numbers; a weight that is not finite needs another fit."});
  if (std::abs(value) < static_cast<double>(FLT_MIN)) return "0.0F";
  return with_point(fmt::format("{:.9g}", static_cast<float>(value))) + "F";
}

std::string CText::number(double value, std::string_view what) const {
  if (real_ == CReal::single) return float_number(value, what);
  if (!std::isfinite(value))
    throw Error({.place = std::string(what.empty() ? "a number of the model" : what),
                 .expected = "a finite number",
                 .found = fmt::format("{}", value)});
  return with_point(fmt::format("{}", value));
}

std::string CText::filled(std::string_view text, std::initializer_list<Value> values) const {
  std::string result(text);
  for (const auto& [key, value] : values) replace_all(result, fmt::format("${}$", key), value);
  replace_all(result, "@", name_ + "_");
  return result;
}

void CText::add_table(std::string_view type, std::string_view name, std::string_view values,
                      std::size_t count, std::size_t bytes) {
  if (count == 0 || !claim(fmt::format("table {}", name))) return;
  tables_ += filled("static const $TYPE$ @$NAME$[$COUNT$] = {\n    $VALUES$};\n",
                    {{"TYPE", std::string(type)},
                     {"NAME", std::string(name)},
                     {"COUNT", fmt::format("{}", count)},
                     {"VALUES", std::string(values)}});
  table_bytes_ += bytes;
}

std::string CText::table(std::string_view name, std::span<const double> values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i == 0 ? "" : i % kPerLine == 0 ? ",\n    " : ", ") + number(values[i], name);
  add_table("@real", name, text, values.size(),
            values.size() * (real_ == CReal::single ? sizeof(float) : sizeof(double)));
  return fmt::format("{}_{}", name_, name);
}

std::string CText::float_table(std::string_view name, std::span<const float> values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i == 0              ? ""
             : i % kPerLine == 0 ? ",\n    "
                                 : ", ") +
            float_number(static_cast<double>(values[i]), name);
  add_table("float", name, text, values.size(), values.size() * sizeof(float));
  return fmt::format("{}_{}", name_, name);
}

std::string CText::index_table(std::string_view name, std::span<const std::size_t> values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i)
    text += fmt::format("{}{}U", i == 0 ? "" : ", ", values[i]);
  add_table("uint16_t", name, text, values.size(), values.size() * sizeof(std::uint16_t));
  return fmt::format("{}_{}", name_, name);
}

void CText::Layout::add(const Layout& member, std::size_t count) {
  bytes =
      (bytes + member.alignment - 1) / member.alignment * member.alignment + count * member.whole();
  alignment = std::max(alignment, member.alignment);
}

void CText::add_member(Layout& layout, std::string_view declaration) const {
  const std::size_t bracket = declaration.find('[');
  const std::size_t count =
      bracket == std::string_view::npos
          ? 1
          : static_cast<std::size_t>(std::stoul(std::string(declaration.substr(bracket + 1))));
  const std::string_view type = declaration.substr(0, declaration.find(' '));
  const auto plain = [](std::size_t bytes) { return Layout{.bytes = bytes, .alignment = bytes}; };
  if (type.starts_with('@') && type != "@real")
    layout.add(structs_.find(type.substr(1))->second, count);
  else if (type == "@real")
    layout.add(plain(real_ == CReal::single ? sizeof(float) : sizeof(double)), count);
  else
    layout.add(plain(type == "int64_t" ? sizeof(std::int64_t) : sizeof(std::int32_t)), count);
}

void CText::member(std::string_view declaration) {
  members_ += filled("  $WHAT$;\n", {{"WHAT", std::string(declaration)}});
  add_member(state_, declaration);
}

void CText::add_struct(std::string_view name, std::string_view comment,
                       std::span<const std::string_view> members) {
  Layout layout;
  std::string text = fmt::format("\n/* {} */\ntypedef struct {{\n", comment);
  for (const std::string_view member : members) {
    text += fmt::format("  {};\n", member);
    add_member(layout, member);
  }
  types_ += filled(text + fmt::format("}} @{};\n", name));
  structs_.emplace(name, layout);
}

void CText::end_state() {
  types_ += filled("\ntypedef struct {\n" + members_ + "} @state;\n");
  structs_.emplace("state", state_);
}

std::size_t CText::size_of(std::string_view name) const {
  return structs_.find(name)->second.whole();
}

std::string CText::functions() const {
  std::string text = functions_;
  // From the last to the first, since each may call those before it.
  const std::span<const CMathFunction> provided = c_math(real_);
  for (auto function = provided.rbegin(); function != provided.rend(); ++function)
    if (text.find(filled(function->call)) != std::string::npos)
      text.insert(0, filled(function->text));
  return text;
}

}  // namespace torsio
