#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/text_cursor.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, 6> kNames{"se", "linear",   "periodic",
                                                 "rq", "matern32", "matern52"};
constexpr std::string_view kArd = "_ard";
constexpr std::size_t kDeepest = 100;

constexpr std::size_t number_of(KernelKind kind) { return static_cast<std::size_t>(kind); }

/// expression = product {"+" product}, product = factor {"*" factor},
/// factor = name | "(" expression ")"
class Parser {
 public:
  Parser(std::string_view text, std::size_t inputs) : text_(text), inputs_(inputs) {}

  KernelExpression parse() {
    expression();
    if (!text_.at_end()) refuse("'+', '*' or the end");
    return std::move(kernel_);
  }

 private:
  void expression() {
    if (++depth_ > kDeepest) refuse(fmt::format("at most {} brackets in each other", kDeepest));
    product();
    while (text_.take('+')) {
      product();
      join(KernelKind::sum);
    }
    --depth_;
  }

  void product() {
    const std::size_t first = kernel_.nodes.size();
    factor();
    while (text_.take('*')) {
      factor();
      join(KernelKind::product);
    }
    const auto begin = kernel_.nodes.begin() + static_cast<std::ptrdiff_t>(first);
    const auto has = [&](KernelKind kind) {
      return std::any_of(begin, kernel_.nodes.end(),
                         [&](const KernelNode& node) { return node.kind == number_of(kind); });
    };
    const bool is_scaled_already = std::any_of(begin, kernel_.nodes.end(), &is_scaled);
    if (!has(KernelKind::sum) && !has(KernelKind::linear) && !is_scaled_already)
      begin->scaled = true;
  }

  static bool is_scaled(const KernelNode& node) { return node.scaled; }

  void factor() {
    if (text_.take('(')) {
      expression();
      if (!text_.take(')')) refuse("')'");
      return;
    }
    const std::string_view word = text_.next_word();
    std::string_view name = word;
    const bool is_ard = name.ends_with(kArd);
    if (is_ard) name.remove_suffix(kArd.size());
    const auto* const known = std::ranges::find(kNames, name);
    if (known == kNames.end())
      refuse(fmt::format("'(' or one of {}, each optionally followed by {}",
                         "se, linear, periodic, rq, matern32, matern52", kArd),
             word);
    text_.skip(word);
    const auto kind = static_cast<std::size_t>(known - kNames.begin());
    add({.kind = kind,
         .shape = kind == number_of(KernelKind::periodic) ||
                          kind == number_of(KernelKind::rational_quadratic)
                      ? 1.0
                      : 0.0,
         .length_scales = std::vector<double>(is_ard ? inputs_ : 1, 1.0)});
  }

  void join(KernelKind kind) { add({.kind = number_of(kind), .length_scales = {}}); }

  void add(KernelNode node) {
    if (kernel_.nodes.size() == Kernel::kMaxNodes)
      refuse(fmt::format("at most {} kernels, sums and products", Kernel::kMaxNodes));
    kernel_.nodes.push_back(std::move(node));
  }

  [[noreturn]] void refuse(std::string_view expected, std::string_view found = {}) {
    if (found.empty()) found = text_.next_token();
    torsio::refuse<UsageError>(
        fmt::format("kernel \"{}\", column {}", text_.text(), text_.position() + 1), expected,
        found.empty() ? std::string("the end") : fmt::format("'{}'", found));
  }

  TextCursor text_;
  std::size_t inputs_;
  std::size_t depth_ = 0;
  KernelExpression kernel_;
};

std::string name_of(const KernelNode& node) {
  if (node.kind >= kNames.size()) return "?";
  return std::string(kNames[node.kind]) +
         (node.length_scales.size() > 1 ? std::string(kArd) : std::string());
}

}  // namespace

KernelExpression parse_kernel(std::string_view text, std::size_t inputs) {
  return Parser(text, inputs).parse();
}

std::string text_of(const KernelExpression& kernel) {
  struct Part {
    std::string text;
    bool is_sum;
  };
  std::vector<Part> parts;
  const auto factor = [](const Part& part) {
    return part.is_sum ? '(' + part.text + ')' : part.text;
  };
  for (const KernelNode& node : kernel.nodes) {
    const bool is_sum = node.kind == number_of(KernelKind::sum);
    if (!is_sum && node.kind != number_of(KernelKind::product)) {
      parts.push_back({name_of(node), false});
      continue;
    }
    if (parts.size() < 2) return "?";
    const Part right = std::move(parts.back());
    parts.pop_back();
    Part& left = parts.back();
    left = is_sum ? Part{left.text + '+' + right.text, true}
                  : Part{factor(left) + '*' + factor(right), false};
  }
  return parts.size() == 1 ? parts.front().text : "?";
}

}  // namespace torsio
