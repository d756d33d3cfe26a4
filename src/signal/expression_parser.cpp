#include "signal/expression_parser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/checks.hpp"
#include "core/text_cursor.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

struct Function {
  std::string_view name;
  Operation operation;
  std::size_t argument_count;
};

constexpr auto kFunctions = std::to_array<Function>({
    {"rate", Operation::rate, 1},
    {"lowpass", Operation::lowpass, 2},
    {"lag", Operation::lag, 2},
    {"stop", Operation::stop, 2},
    {"dahl", Operation::dahl, 2},
    {"sign", Operation::sign, 1},
    {"tanh", Operation::tanh, 1},
    {"sin", Operation::sin, 1},
    {"cos", Operation::cos, 1},
    {"atan", Operation::atan, 1},
    {"abs", Operation::abs, 1},
    {"sqrt", Operation::sqrt, 1},
    {"exp", Operation::exp, 1},
    {"min", Operation::min, 2},
    {"max", Operation::max, 2},
});

std::string function_list() {
  std::string list = "the functions are ";
  for (const Function& function : kFunctions) {
    if (&function != &kFunctions.front()) list += ", ";
    list += function.name;
  }
  return list;
}

bool is_name(std::string_view text) {
  return !text.empty() && !is_digit(text.front()) &&
         std::all_of(text.begin(), text.end(), is_word_character);
}

// The text as an error message may show it: one line, no control characters, not endless.
std::string shown(std::string_view text, std::size_t around = 0) {
  constexpr std::size_t kBefore = 60;
  constexpr std::size_t kWindow = 120;
  const std::size_t from = text.size() > kWindow && around > kBefore ? around - kBefore : 0;
  return (from > 0 ? "..." : "") + on_one_line(text.substr(from, kWindow)) +
         (text.size() > from + kWindow ? "..." : "");
}

}  // namespace

// One text, read from left to right by recursive descent:
//   sum := product (('+' | '-') product)*            product := signed (('*' | '/') signed)*
//   signed := ('-' | '+') signed | power             power := primary ('^' signed)?
//   primary := number [unit] | name | name '(' sum (',' sum)* ')' | '(' sum ')'
class ExpressionParser::Reader {
 public:
  Reader(ExpressionParser& parser, std::string_view text, std::string_view title)
      : parser_(parser), graph_(parser.graph_), text_(text), title_(title) {}

  std::uint32_t read_all() {
    if (text_.text().size() > kLongestExpression)
      fail(0, fmt::format("at most {} characters", kLongestExpression),
           fmt::format("{}", text_.text().size()));
    const Operand whole = sum();
    if (!text_.at_end()) fail_here("an operator or the end");
    return whole.node;
  }

 private:
  struct Operand {
    std::uint32_t node = 0;
    std::size_t start = 0;
    std::string_view si_unit = {};  // unit of a number that was written with one
  };

  [[noreturn]] void fail(std::size_t at, std::string_view expected, std::string_view found,
                         std::string_view advice = {}) const {
    refuse(fmt::format("{} '{}': column {}", title_, shown(text_.text(), at), at + 1), expected,
           found, advice);
  }

  [[noreturn]] void fail_here(std::string_view expected) {
    const std::string found = found_here();
    fail(text_.position(), expected, found);
  }

  std::string found_here() {
    if (text_.at_end()) return "the end";
    const std::string_view token = text_.next_token();
    if (is_printable(token.front())) return fmt::format("'{}'", shown(token));
    return fmt::format("byte 0x{:02x}", static_cast<unsigned char>(token.front()));
  }

  void want(char c) {
    if (!text_.take(c)) fail_here(fmt::format("'{}'", c));
  }

  Operand joined(Operation operation, const Operand& left, const Operand& right) {
    return finite({graph_.operation(operation, left.node, right.node), left.start});
  }

  Operand finite(const Operand& operand) const {
    const double value = graph_.nodes()[operand.node].parameter;
    if (graph_.is_constant(operand.node) && !std::isfinite(value))
      fail(operand.start, "a finite constant", std::isnan(value) ? "NaN" : "an infinite one");
    return operand;
  }

  Operand sum() {
    Operand result = product();
    for (;;) {
      if (text_.take('+'))
        result = joined(Operation::add, result, product());
      else if (text_.take('-'))
        result = joined(Operation::subtract, result, product());
      else
        return result;
    }
  }

  Operand product() {
    Operand result = signed_power();
    for (;;) {
      if (text_.take('*'))
        result = joined(Operation::multiply, result, signed_power());
      else if (text_.take('/'))
        result = joined(Operation::divide, result, signed_power());
      else
        return result;
    }
  }

  // Every way to nest passes through here.
  Operand signed_power() {
    if (parser_.depth_ == kDeepestNesting)
      fail(text_.position(), fmt::format("at most {} levels of nesting", kDeepestNesting), "more");
    ++parser_.depth_;
    const Operand result = signed_power_one_level_down();
    --parser_.depth_;
    return result;
  }

  Operand signed_power_one_level_down() {
    text_.skip_blanks();  // to the first character, for its column
    const std::size_t start = text_.position();
    if (text_.take('+')) return signed_power();
    if (text_.take('-')) {
      const std::uint32_t operand = signed_power().node;
      return {graph_.operation(Operation::negate, operand, operand), start};
    }
    const Operand base = primary();
    return text_.take('^') ? joined(Operation::power, base, signed_power()) : base;
  }

  Operand primary() {
    if (text_.at_end()) fail_here("a channel, a number, a function or '('");
    const std::size_t start = text_.position();
    const char c = text_.next();
    if (is_digit(c) || c == '.') return number();
    if (text_.take('(')) {
      Operand inside = sum();
      want(')');
      inside.start = start;
      return inside;
    }
    if (!is_letter(c)) fail_here("a channel, a number, a function or '('");
    const std::string_view word = text_.take_word();
    if (text_.take('(')) return call(word, start);
    return {named(word, start), start};
  }

  Operand number() {
    const NumberText written = text_.next_number();
    const std::size_t start = text_.position();
    if (!written.fits) fail_here("a number that a double can hold");
    text_.skip(written.text);
    if (!is_letter(text_.next())) return {graph_.constant(written.value), start};
    const std::size_t unit_start = text_.position();
    const std::string_view suffix = text_.take_word();
    const Unit* const unit = find_unit(suffix);
    if (unit == nullptr)
      fail(unit_start, "a unit or an operator after the number", fmt::format("'{}'", shown(suffix)),
           "a product needs its '*'; the units are " + known_unit_list());
    return finite({graph_.constant(unit->si(written.value)), start, unit->si_suffix});
  }

  std::uint32_t named(std::string_view name, std::size_t start) {
    const auto definition = parser_.definition_index_.find(name);
    if (definition == parser_.definition_index_.end()) return graph_.channel(name);
    if (parser_.definition_nodes_[definition->second] == kBeingRead)
      fail(start, "a definition that does not need itself",
           fmt::format("'{}', which is being defined", shown(name)));
    return parser_.parse_definition(definition->second);
  }

  Operand call(std::string_view name, std::size_t start) {
    const auto* const function =
        std::find_if(kFunctions.begin(), kFunctions.end(),
                     [name](const Function& known) { return known.name == name; });
    if (function == kFunctions.end())
      fail(start, "a function", fmt::format("'{}'", shown(name)), function_list());
    std::array<Operand, 2> arguments;
    for (std::size_t i = 0; i < function->argument_count; ++i) {
      if (i > 0 && !text_.take(','))
        fail_here(fmt::format("',' and argument {} of {}", i + 1, function->name));
      arguments[i] = sum();
    }
    if (text_.next_is(','))
      fail_here(fmt::format("')': {} takes {} argument{}", function->name, function->argument_count,
                            function->argument_count == 1 ? "" : "s"));
    want(')');
    if (function->argument_count == 1) arguments[1] = arguments[0];
    return finite({node_of(function->operation, arguments), start});
  }

  std::uint32_t node_of(Operation operation, const std::array<Operand, 2>& arguments) {
    const std::uint32_t first = arguments[0].node;
    switch (operation) {
      case Operation::rate: return graph_.memory(operation, first, 0.0);
      case Operation::lowpass: return graph_.memory(operation, first, cutoff_of(arguments[1]));
      case Operation::lag: return graph_.memory(operation, first, lag_of(arguments[1]));
      case Operation::stop:
      case Operation::dahl: return graph_.memory(operation, first, distance_of(arguments[1]));
      default: return graph_.operation(operation, first, arguments[1].node);
    }
  }

  double cutoff_of(const Operand& argument) const {
    if (!graph_.is_constant(argument.node) ||
        (!argument.si_unit.empty() && argument.si_unit != "Hz"))
      fail(argument.start, "a constant frequency as cut-off, like 10Hz", as_written(argument));
    const double value = graph_.nodes()[argument.node].parameter;
    if (!parser_.sample_rate_Hz_) return value;
    try {
      const Lowpass checks(value, *parser_.sample_rate_Hz_);
    } catch (const UsageError& error) {
      fail(argument.start, error.report().expected, error.report().found);
    }
    return value;
  }

  double lag_of(const Operand& argument) const {
    const double value = graph_.nodes()[argument.node].parameter;
    const bool is_time = argument.si_unit == "s";
    const bool is_constant = graph_.is_constant(argument.node) && value >= 0.0;
    if (is_constant && is_time && !parser_.sample_rate_Hz_) return value;
    const double samples = is_time ? samples_of(value) : value;
    if (!is_constant || (!is_time && !argument.si_unit.empty()) ||
        samples > static_cast<double>(kLongestLag) || samples != std::floor(samples))
      fail(argument.start,
           fmt::format("a whole number of samples from 0 to {}, or their time, like 10ms",
                       kLongestLag),
           as_written(argument),
           is_time ? fmt::format("One sample is {:g} ms.", 1e3 / *parser_.sample_rate_Hz_) : "");
    return samples + 0.0;  // no negative zero
  }

  /// A time in samples, whole if it is so but for rounding.
  double samples_of(double time_s) const {
    constexpr double kRounding = 1e-6;
    const double samples = time_s * parser_.sample_rate_Hz_.value_or(1.0);
    const double whole = std::round(samples);
    return std::abs(samples - whole) <= kRounding ? whole : samples;
  }

  double distance_of(const Operand& argument) const {
    const double value = graph_.nodes()[argument.node].parameter;
    if (!graph_.is_constant(argument.node) || !(value > 0.0))
      fail(argument.start, "a positive constant in the unit of the first argument",
           as_written(argument));
    return value;
  }

  // The argument's text; the reader is after the call's closing parenthesis.
  std::string as_written(const Operand& argument) const {
    std::string_view written = text_.since(argument.start);
    written.remove_suffix(1);
    while (is_blank(written.back())) written.remove_suffix(1);
    return fmt::format("'{}'", shown(written));
  }

  ExpressionParser& parser_;
  ExpressionGraph& graph_;
  TextCursor text_;
  std::string_view title_;
};

ExpressionParser::ExpressionParser(ExpressionGraph& graph,
                                   std::span<const ChannelDefinition> definitions,
                                   std::optional<double> sample_rate_Hz)
    : graph_(graph),
      definitions_(definitions),
      definition_nodes_(definitions.size(), kUnread),
      sample_rate_Hz_(sample_rate_Hz) {
  for (std::size_t i = 0; i < definitions.size(); ++i) {
    const std::string& name = definitions[i].name;
    const std::string place = fmt::format("definition {} '{}'", i + 1, shown(name));
    if (!is_name(name))
      throw Error({.place = place,
                   .expected = "a name of letters, digits and '_' that starts with a letter",
                   .found = fmt::format("'{}'", shown(name))});
    if (!definition_index_.try_emplace(name, i).second)
      throw Error({.place = place, .problem = "there is already a definition of this name"});
  }
}

std::uint32_t ExpressionParser::parse(std::string_view text, std::string_view title) {
  return Reader(*this, text, title).read_all();
}

void ExpressionParser::check_unused_definitions() {
  for (std::size_t i = 0; i < definitions_.size(); ++i) parse_definition(i);
}

std::uint32_t ExpressionParser::parse_definition(std::size_t index) {
  std::uint32_t& node = definition_nodes_[index];
  if (node != kUnread) return node;
  node = kBeingRead;
  const auto& [name, expression] = definitions_[index];
  node = parse(expression, fmt::format("definition {} =", shown(name)));
  graph_.declare_rate_if_named(node, name);
  return node;
}

}  // namespace torsio
