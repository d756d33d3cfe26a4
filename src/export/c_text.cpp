#include "export/c_text.hpp"

#include <fmt/format.h>

#include <cfloat>
#include <cmath>
#include <ranges>

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
  if (count == 0) return;
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

namespace {

/// Bytes of a type of the program.
std::size_t size_of(std::string_view type, std::size_t real) {
  if (type == "@real") return real;
  if (type == "int64_t") return sizeof(std::int64_t);
  if (type == "@filter") return 2 * real + real;  // with the padding of its flag
  if (type == "@stop" || type == "@dahl" || type == "@travel") return 5 * real;
  return sizeof(std::int32_t);
}

}  // namespace

void CText::member(std::string_view declaration) {
  members_ += filled("  $WHAT$;\n", {{"WHAT", std::string(declaration)}});
  const std::size_t blank = declaration.find(' ');
  const std::size_t bracket = declaration.find('[');
  const std::size_t count =
      bracket == std::string_view::npos
          ? 1
          : static_cast<std::size_t>(std::stoul(std::string(declaration.substr(bracket + 1))));
  const std::string_view type = declaration.substr(0, blank);
  const std::size_t real = real_ == CReal::single ? sizeof(float) : sizeof(double);
  const std::size_t size = size_of(type, real);
  const std::size_t alignment = type.starts_with('@') ? real : size;
  member_bytes_ = (member_bytes_ + alignment - 1) / alignment * alignment + count * size;
}

std::size_t CText::state_bytes() const noexcept {
  const bool is_wide = real_ == CReal::twofold || members_.find("int64_t") != std::string::npos;
  const std::size_t alignment = is_wide ? sizeof(double) : sizeof(float);
  return (member_bytes_ + alignment - 1) / alignment * alignment;
}

std::string CText::functions() const {
  std::string text = functions_;
  // From the last to the first, since each may call those before it.
  for (const CMathFunction& function : std::views::reverse(c_math(real_)))
    if (text.find(filled(function.call)) != std::string::npos) text = filled(function.text) + text;
  return text;
}

}  // namespace torsio
