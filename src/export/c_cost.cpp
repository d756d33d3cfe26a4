#include "torsio/export/c_cost.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <string>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/export/c99.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, kCWorkCount> kWorkNames{
    "step",       "interpolation", "input",  "counted",     "jump",         "counted_jump",
    "conversion", "feature",       "filter", "stop",        "dahl",         "rate",
    "operation",  "exponential",   "root",   "sine",        "arc_tangent",  "logarithm",
    "tangent",    "memory",        "term",   "schedule",    "scheduled",    "polynomial",
    "power",      "direction",     "search", "cell",        "element",      "relaxation",
    "section",    "bank",          "border", "scaled",      "layer",        "weight",
    "unit",       "gate",          "kernel", "kernel_term", "kernel_value", "kernel_weight",
    "kernel_unit"};
constexpr std::array<std::string_view, kCCodeCount> kCodeNames{
    "program", "function",   "call",       "branch",     "member", "element",
    "number",  "arithmetic", "comparison", "assignment", "wide"};
constexpr std::array<std::string_view, kCStackCount> kStackNames{
    "program", "local_byte", "interpolation", "interpolated_input",
    "counted", "stop",       "dahl",          "function",
    "memory",  "layer",      "gate",          "process",
    "kernel",  "schedule",   "lone_schedule", "bank",
    "border"};

// PRICES BEGIN
constexpr CTarget::Prices kM4fFloat{
    .instructions = {116.3,  66.15, 12.88, 18.9,  12.68, 18.9,  0.0,   25.45, 30.04, 61.08, 77.46,
                     0.6151, 0.0,   15.52, 42.12, 68.12, 54.23, 57.21, 26.62, 21.37, 1.396, 11.13,
                     33.97,  16.44, 4.148, 86.09, 3.347, 19.59, 20.5,  14.93, 44.35, 23.73, 39.92,
                     0.0,    0.0,   6.389, 8.81,  10.74, 0.0,   9.22,  8.877, 6.569, 28.12},
    .code_bytes = {-1023.0, 0.0, 6.071, 14.75, 5.953, 6.17, 12.69, 0.0, 0.0, 0.0, 22.89},
    .stack_bytes = {31.77, 0.9437, 34.11, 11.04, 76.88, 4.456, 3.593, 4.651, 44.88, 0.0, 0.0, 0.0,
                    15.54, 20.78, 27.56, 13.43, 4.904},
};
constexpr CTarget::Prices kM7Double{
    .instructions = {151.8, 58.43, 2.461, 12.88, 2.111, 12.88, 3.653, 9.918, 37.25, 66.51, 123.4,
                     11.79, 14.6,  52.33, 44.12, 137.9, 227.0, 122.2, 25.59, 32.66, 5.427, 0.0,
                     35.21, 21.23, 2.682, 76.54, 34.66, 9.231, 14.31, 15.39, 54.01, 0.0,   37.77,
                     0.0,   0.0,   6.45,  8.615, 11.33, 123.3, 1.517, 34.07, 6.877, 34.42},
    .code_bytes = {-1244.0, 0.0, 8.365, 7.823, 7.902, 3.272, 11.06, 0.0, 7.503, 0.0, 21.57},
    .stack_bytes = {39.31, 0.9764, 107.1, 0.0, 57.59, 19.18, 57.53, 36.59, 78.79, 0.0, 0.0, 50.37,
                    0.0, 55.1, 43.3, 4.66, 0.0},
};
constexpr CTarget::Prices kM7Float{
    .instructions = {122.3,  57.81, 12.23, 19.83, 11.99, 19.83, 0.6075, 27.29, 31.62, 57.09,  72.82,
                     0.3538, 0.0,   15.7,  37.54, 67.73, 56.74, 48.63,  25.17, 22.72, 0.1656, 11.99,
                     33.67,  11.62, 4.191, 89.86, 0.0,   20.88, 21.88,  15.68, 45.82, 30.71,  41.62,
                     0.0,    0.0,   6.487, 7.922, 10.78, 0.0,   10.02,  10.1,  6.873, 20.4},
    .code_bytes = {-1091.0, 0.0, 4.467, 17.04, 6.071, 5.698, 12.77, 0.0, 0.0, 0.0, 25.64},
    .stack_bytes = {32.59, 0.9296, 33.63, 11.29, 77.01, 3.806, 19.61, 3.864, 44.47, 0.0, 0.0, 3.687,
                    19.87, 24.35, 32.78, 13.54, 7.899},
};
// PRICES END

constexpr std::array kTargets{
    CTarget{.name = "cortex-m4f",
            .description = "Cortex-M4 with its FPU, gcc -O2 -mcpu=cortex-m4 -mfloat-abi=hard",
            .single = &kM4fFloat,
            .twofold = nullptr},
    CTarget{.name = "cortex-m7",
            .description = "Cortex-M7 with its FPU for doubles, gcc -O2 -mcpu=cortex-m7 "
                           "-mfpu=fpv5-d16 -mfloat-abi=hard",
            .single = &kM7Float,
            .twofold = &kM7Double}};

const CTarget::Prices* prices_of(const CTarget& target, CReal real) {
  return real == CReal::single ? target.single : target.twofold;
}

template <class Counts>
double weighted_total(const Counts& counts, const Counts& prices) {
  return std::inner_product(counts.begin(), counts.end(), prices.begin(), 0.0);
}

bool is_word(char letter) {
  return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '_';
}

/// Whether a word before a bracket is not a function.
bool is_keyword(std::string_view word) {
  return word == "if" || word == "for" || word == "while" || word == "return" || word == "sizeof";
}

}  // namespace

std::string_view name(CWork kind) noexcept { return kWorkNames[static_cast<std::size_t>(kind)]; }
std::string_view name(CCode kind) noexcept { return kCodeNames[static_cast<std::size_t>(kind)]; }
std::string_view name(CStack kind) noexcept { return kStackNames[static_cast<std::size_t>(kind)]; }

CCodeCounts c_code(std::string_view functions) {
  CCodeCounts counts{};
  const auto count = [&](CCode kind) { counts[static_cast<std::size_t>(kind)] += 1.0; };
  const auto begins = [&](std::size_t at, std::string_view text) {
    return functions.substr(at, text.size()) == text;
  };
  count(CCode::program);
  for (std::size_t i = 0; i < functions.size();) {
    if (begins(i, "/*")) {
      i = std::min(functions.find("*/", i), functions.size() - 2) + 2;
      continue;
    }
    if (is_word(functions[i])) {
      std::size_t end = i;
      const bool is_number = std::isdigit(static_cast<unsigned char>(functions[i])) != 0;
      // The sign of an exponent belongs to a number.
      while (end < functions.size() &&
             (is_word(functions[end]) ||
              (is_number &&
               (functions[end] == '.' || (functions[end - 1] == 'e' && functions[end] == '-') ||
                (functions[end - 1] == 'e' && functions[end] == '+')))))
        ++end;
      const std::string_view word = functions.substr(i, end - i);
      if (is_number) {
        if (word.find('.') != std::string_view::npos) count(CCode::number);
      } else if (word == "if" || word == "for" || word == "while") {
        count(CCode::branch);
      } else if (word == "int64_t" || word == "uint64_t" || word == "INT64_C" ||
                 word == "UINT64_C") {
        count(CCode::wide);
      } else if (word == "static") {
        count(CCode::function);
      } else if (begins(end, "(") && !is_keyword(word)) {
        count(CCode::call);
      }
      i = end;
      continue;
    }
    const bool is_pair = begins(i, "->") || begins(i, "&&") || begins(i, "||") || begins(i, "<=") ||
                         begins(i, ">=") || begins(i, "==") || begins(i, "!=") || begins(i, "+=") ||
                         begins(i, "-=") || begins(i, "*=") || begins(i, "++") || begins(i, "--");
    switch (functions[i]) {
      case '[': count(CCode::element); break;
      case '.': count(CCode::member); break;
      case '?': count(CCode::branch); break;
      case '&':
      case '|':
        if (is_pair) count(CCode::branch);
        break;
      case '-': count(begins(i, "->") ? CCode::member : CCode::arithmetic); break;
      case '+':
      case '/': count(CCode::arithmetic); break;
      case '*':
        if (begins(i, "* ") || is_pair) count(CCode::arithmetic);  // others are pointers
        break;
      case '<':
      case '>': count(CCode::comparison); break;
      case '!':
        if (is_pair) count(CCode::comparison);
        break;
      case '=': count(is_pair ? CCode::comparison : CCode::assignment); break;
      default: break;
    }
    i += is_pair ? 2 : 1;
  }
  return counts;
}

CStackCounts c_stack(const CWorkCounts& work, std::size_t local_bytes) noexcept {
  const auto of = [&work](CWork kind) { return work[static_cast<std::size_t>(kind)]; };
  const auto any = [&of](auto... kinds) { return std::min((of(kinds) + ...), 1.0); };
  // In the order of CStack.
  return {1.0,
          static_cast<double>(local_bytes),
          of(CWork::interpolation),
          of(CWork::interpolation) * of(CWork::input),
          any(CWork::counted),
          any(CWork::stop),
          of(CWork::dahl),
          any(CWork::sine, CWork::arc_tangent, CWork::logarithm),
          any(CWork::memory),
          any(CWork::layer),
          any(CWork::gate),
          any(CWork::kernel),
          of(CWork::kernel),
          any(CWork::schedule) * of(CWork::interpolation),
          any(CWork::schedule) * (1.0 - of(CWork::interpolation)),
          any(CWork::bank),
          any(CWork::border)};
}

std::span<const CTarget> c_targets() noexcept { return kTargets; }

const CTarget& find_c_target(std::string_view name) {
  const auto* const found = std::ranges::find(kTargets, name, &CTarget::name);
  if (found != kTargets.end()) return *found;
  std::vector<std::string> names;
  for (const CTarget& target : kTargets) names.emplace_back(target.name);
  throw UsageError({.place = "--target",
                    .expected = fmt::format("{}", fmt::join(names, ", ")),
                    .found = std::string(name)});
}

CCost c_cost(const C99Program& program, const CTarget& target, CReal real) {
  const CTarget::Prices* const prices = prices_of(target, real);
  if (prices == nullptr)
    throw UsageError({.place = fmt::format("--target {}", target.name),
                      .expected = "--real float",
                      .found = "--real double, which this processor computes in software: its cost "
                               "is not estimated"});
  return {.flash = static_cast<double>(program.table_bytes) +
                   weighted_total(program.code, prices->code_bytes),
          .ram = static_cast<double>(program.state_bytes),
          .stack = weighted_total(c_stack(program.work, program.local_bytes), prices->stack_bytes),
          .instructions = weighted_total(program.work, prices->instructions)};
}

}  // namespace torsio
