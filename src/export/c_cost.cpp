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
    "step",        "interpolation", "input",         "counted",     "jump",         "counted_jump",
    "conversion",  "feature",       "filter",        "stop",        "dahl",         "rate",
    "operation",   "exponential",   "root",          "sine",        "arc_tangent",  "logarithm",
    "tangent",     "memory",        "term",          "schedule",    "scheduled",    "polynomial",
    "power",       "direction",     "search",        "cell",        "element",      "relaxation",
    "section",     "bank",          "border",        "scaled",      "layer",        "weight",
    "unit",        "gate",          "kernel",        "kernel_term", "kernel_value", "kernel_weight",
    "kernel_unit", "control",       "speed_control", "observer",    "brake",        "inversion",
    "evaluation",  "evaluated"};
constexpr std::array<std::string_view, kCCodeCount> kCodeNames{
    "program", "function",   "call",       "branch",     "member", "element",
    "number",  "arithmetic", "comparison", "assignment", "wide"};
constexpr std::array<std::string_view, kCStackCount> kStackNames{
    "program",       "local_byte",
    "interpolation", "interpolated_input",
    "counted",       "stop",
    "dahl",          "function",
    "memory",        "layer",
    "gate",          "process",
    "kernel",        "schedule",
    "lone_schedule", "bank",
    "border",        "control",
    "inversion",     "curve",
    "shared",        "scheduled_polynomial"};

// PRICES BEGIN
constexpr CTarget::Prices kM4fFloat{
    .instructions = {128.5, 73.83, 10.54, 16.84, 10.2,   16.84, 0.0,   24.68, 31.45, 63.58,
                     80.05, 1.825, 0.0,   15.84, 45.96,  70.84, 59.03, 61.05, 27.33, 29.51,
                     0.0,   27.1,  28.06, 15.22, 4.133,  85.36, 0.0,   22.69, 21.49, 12.96,
                     31.24, 17.75, 38.97, 0.0,   0.0,    6.409, 7.589, 10.06, 0.0,   8.635,
                     5.976, 6.313, 34.9,  881.2, 1086.0, 104.5, 120.3, 0.0,   76.21, 11.97},
    .code_bytes = {-902.3, 0.0, 5.991, 17.02, 3.836, 10.01, 11.51, 0.0, 0.0, 0.0, 20.89},
    .stack_bytes = {32.47, 0.9258, 57.12, 1.714, 49.96, 4.518, 3.53,  5.329, 39.25, 0.0,   4.552,
                    0.0,   14.26,  29.08, 24.69, 14.7,  13.62, 79.56, 0.0,   0.0,   12.99, 20.87},
};
constexpr CTarget::Prices kM7Float{
    .instructions = {132.8, 66.36, 10.0,  16.25, 9.659,  16.25, 2.428, 23.26, 34.43, 61.41,
                     77.71, 2.96,  2.409, 15.43, 39.75,  69.42, 56.22, 50.84, 25.3,  28.91,
                     0.0,   26.24, 28.94, 6.894, 4.529,  89.43, 0.0,   23.34, 20.95, 14.39,
                     33.12, 15.27, 41.42, 0.0,   0.0,    6.476, 7.454, 10.71, 0.0,   9.561,
                     8.855, 6.739, 24.15, 872.4, 1056.0, 112.7, 114.2, 0.0,   79.1,  10.26},
    .code_bytes = {-962.8, 0.0, 4.687, 19.32, 3.719, 9.622, 11.56, 0.0, 0.0, 0.0, 22.89},
    .stack_bytes = {33.02, 0.9173, 56.79, 1.843, 49.82, 3.911, 19.6,  4.414, 39.14, 0.0,   4.59,
                    4.027, 18.62,  32.78, 26.53, 14.66, 15.29, 80.23, 0.0,   0.0,   12.87, 26.87},
};
constexpr CTarget::Prices kM7Double{
    .instructions = {166.9, 53.94, 2.305, 12.97, 1.707,  12.97, 0.6719, 18.44, 36.88, 61.12,
                     115.6, 11.0,  7.875, 53.13, 50.37,  142.5, 242.2,  128.5, 26.74, 38.54,
                     0.0,   0.0,   28.95, 19.0,  2.602,  82.08, 0.0,    25.59, 18.93, 14.7,
                     39.97, 8.548, 36.96, 0.0,   0.0,    6.508, 6.28,   9.953, 124.9, 0.5373,
                     28.8,  6.433, 46.1,  909.5, 1081.0, 69.76, 127.5,  0.0,   74.73, 10.1},
    .code_bytes = {-991.3, 0.0, 9.626, 16.02, 3.795, 8.173, 10.28, 0.0, 0.0, 0.0, 21.55},
    .stack_bytes = {39.08, 0.9698, 106.0, 1.531, 37.06, 19.68, 57.95, 34.71, 66.51, 0.0, 0.0,
                    50.69, 0.0,    56.19, 45.36, 15.75, 14.9,  194.1, 0.0,   0.0,   0.0, 80.19},
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

CStackCounts c_stack(const CWorkCounts& work, std::size_t local_bytes,
                     bool has_controller) noexcept {
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
          any(CWork::border),
          any(CWork::control, CWork::speed_control),
          any(CWork::inversion),
          any(CWork::evaluation),
          has_controller ? 1.0 : 0.0,
          any(CWork::schedule) * any(CWork::polynomial)};
}

std::span<const CTarget> c_targets() noexcept { return kTargets; }

const CTarget& find_c_target(std::string_view name) {
  const auto* const found = std::ranges::find(kTargets, name, &CTarget::name);
  if (found != kTargets.end()) return *found;
  std::vector<std::string> names;
  names.reserve(kTargets.size());
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
  const auto step = [&](const CWorkCounts& work) {
    return CCost::Step{.stack = weighted_total(
                           c_stack(work, program.local_bytes, program.control_work.has_value()),
                           prices->stack_bytes),
                       .instructions = weighted_total(work, prices->instructions)};
  };
  CCost cost{.flash = static_cast<double>(program.table_bytes) +
                      weighted_total(program.code, prices->code_bytes),
             .ram = static_cast<double>(program.state_bytes),
             .step = step(program.work)};
  if (program.control_work) cost.control = step(*program.control_work);
  return cost;
}

}  // namespace torsio
