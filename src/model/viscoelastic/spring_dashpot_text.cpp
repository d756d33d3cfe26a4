#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/text_cursor.hpp"
#include "core/trimmed.hpp"
#include "model/viscoelastic/spring_dashpot_network.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kDeepest = 50;
constexpr std::size_t kLongest = 4000;
constexpr std::size_t kHighestNumber = 999'999;

struct Preset {
  std::string_view name;
  std::string_view text;
  double scale = 1.0;  ///< factor of its values, to Nm/rad
};

// Paper 003, Table 3, is per degree. Topologies: specification 2.1.
constexpr double kPerDegree = deg_from_rad(1.0);
constexpr std::array kPresets{
    Preset{"hooke", "k1"},
    Preset{"maxwell", "maxwell(k1, d1)"},
    Preset{"kelvin_voigt", "kv(k1, d1)"},
    Preset{"standard_linear_solid", "parallel(k0, maxwell(k1, d1))"},
    Preset{"burgers", "series(maxwell(k1, d1), kv(k2, d2))"},
    Preset{"003a", "series(kv(k1=3.803, d1=2.172), kv(k2=0.564, d2=13.46), k3=1.737)", kPerDegree},
    Preset{
        "003b",
        "parallel(series(kv(k2=0.636, d2=0.71), k3=0.909), maxwell(k6=0.768, d3=6.159), k5=0.005)",
        kPerDegree},
    Preset{"003c",
           "series(kv(k1=3.823, d1=2.248), k7=73.451, "
           "parallel(k5=0.001, maxwell(k6=1.344, d3=7.799), maxwell(k4=0.426, d4=975.774)))",
           kPerDegree},
    Preset{"003d",
           "series(k7=55.51, "
           "parallel(k5=0.651, maxwell(k6=1.261, d3=9.149), maxwell(k4=0.052, d4=1.833)))",
           kPerDegree},
};
constexpr std::string_view kGeneralised = "generalised_maxwell";
constexpr std::size_t kMaxBranches = 16;

std::string preset_names() {
  std::string names;
  for (const Preset& preset : kPresets) names += fmt::format("{}, ", preset.name);
  return names + fmt::format("{}(n)", kGeneralised);
}

/// One text, from left to right; see `parse_network`.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  SpringDashpotNetwork parse() {
    if (text_.text().size() > kLongest)
      torsio::refuse<UsageError>("network", fmt::format("at most {} characters", kLongest),
                                 fmt::format("{}", text_.text().size()));
    network();
    if (!text_.at_end()) refuse_here("the end");
    return std::move(network_);
  }

  /// The n of generalised_maxwell(n), if the text has this form.
  std::size_t branches() {
    if (text_.take_word() != kGeneralised) return 0;
    want('(', "the number of branches in brackets");
    const std::string_view number = text_.take_word();
    const std::size_t start = text_.position() - number.size();
    std::size_t count = 0;
    const auto [end, code] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (code != std::errc{} || end != number.data() + number.size() || count < 1 ||
        count > kMaxBranches)
      refuse(start, fmt::format("the number of branches, 1 to {}", kMaxBranches), number);
    want(')', "')'");
    if (!text_.at_end()) refuse_here("the end");
    return count;
  }

 private:
  [[noreturn]] void refuse(std::size_t at, std::string_view expected,
                           std::string_view found) const {
    constexpr std::size_t kBefore = 50;
    constexpr std::size_t kWindow = 100;
    const std::size_t from = at > kBefore ? at - kBefore : 0;
    torsio::refuse<UsageError>(
        fmt::format("network: column {}", at + 1), expected,
        found.empty() ? std::string("the end") : fmt::format("'{}'", on_one_line(found)),
        fmt::format("{}\n  {}^", on_one_line(text_.text().substr(from, kWindow)),
                    std::string(at - from, ' ')));
  }
  [[noreturn]] void refuse_here(std::string_view expected) {
    const std::string_view found = text_.next_token();
    refuse(text_.position(), expected, found);
  }

  void want(char c, std::string_view expected) {
    if (!text_.take(c)) refuse_here(expected);
  }
  void add(NetworkNode node, std::size_t start) {
    if (network_.nodes.size() == kMaxNetworkNodes)
      refuse(start, fmt::format("at most {} elements and joins", kMaxNetworkNodes), "more");
    network_.nodes.push_back(node);
  }

  void network() {
    if (++depth_ > kDeepest)
      refuse(text_.position(), fmt::format("at most {} networks in each other", kDeepest), "more");
    const std::string_view word = text_.next_word();
    const std::size_t start = text_.position();
    if (word == "series" || word == "parallel") {
      text_.skip(word);
      join(word == "series" ? NetworkKind::series : NetworkKind::parallel, word, start);
    } else if (word == "kv" || word == "maxwell") {
      text_.skip(word);
      pair(word == "kv" ? NetworkKind::parallel : NetworkKind::series, word, start);
    } else {
      element("", "series, parallel, kv, maxwell, a spring k1 or a dashpot d1");
    }
    --depth_;
  }

  void join(NetworkKind kind, std::string_view word, std::size_t start) {
    want('(', fmt::format("'(' after {}", word));
    std::size_t children = 0;
    do {
      network();
      ++children;
    } while (text_.take(','));
    if (children < 2) refuse_here(fmt::format("',' and a second network to be in {}", word));
    want(')', "',' or ')'");
    add({.kind = static_cast<std::size_t>(kind), .children = children}, start);
  }

  void pair(NetworkKind kind, std::string_view word, std::size_t start) {
    want('(', fmt::format("'(' after {}", word));
    element("k", fmt::format("the spring of {}, like k1", word));
    want(',', fmt::format("',' and the dashpot of {}", word));
    element("d", fmt::format("the dashpot of {}, like d1", word));
    want(')', fmt::format("')': {} takes a spring and a dashpot", word));
    add({.kind = static_cast<std::size_t>(kind), .children = 2}, start);
  }

  /// @param letters those that the name may begin with; empty: k and d
  void element(std::string_view letters, const std::string& expected) {
    const std::string_view word = text_.take_word();
    const std::size_t start = text_.position() - word.size();
    const bool is_known = !word.empty() && (letters.empty() ? word[0] == 'k' || word[0] == 'd'
                                                            : word[0] == letters[0]);
    if (!is_known) refuse_at_word(start, expected, word);
    NetworkNode node{.kind = static_cast<std::size_t>(word[0] == 'k' ? NetworkKind::spring
                                                                     : NetworkKind::dashpot),
                     .label = label_of(word, start, expected),
                     .value = kNotMeasured};
    const bool is_taken = std::ranges::any_of(network_.nodes, [&](const NetworkNode& other) {
      return other.is_leaf() && other.kind == node.kind && other.label == node.label;
    });
    if (is_taken)
      refuse(start, "a name that is used only once: each element is a separate parameter", word);
    if (text_.take('=')) node.value = value();
    add(node, start);
  }

  [[noreturn]] void refuse_at_word(std::size_t start, const std::string& expected,
                                   std::string_view word) {
    text_.return_to(start);
    if (word.empty()) refuse_here(expected);
    refuse(start, expected, word);
  }

  [[nodiscard]] std::size_t label_of(std::string_view word, std::size_t start,
                                     const std::string& expected) const {
    if (word.size() == 1) return 0;
    std::size_t number = 0;
    const auto [end, code] = std::from_chars(word.data() + 1, word.data() + word.size(), number);
    const bool has_leading_zero = word.size() > 2 && word[1] == '0';
    if (code != std::errc{} || end != word.data() + word.size() || has_leading_zero ||
        number > kHighestNumber)
      refuse(start, expected, word);
    return number + 1;
  }

  double value() {
    const NumberText number = text_.next_number();
    const std::size_t start = text_.position();
    if (number.text.empty()) refuse_here("a start value, like 0.68");
    text_.skip(number.text);
    if (!number.fits || !(number.value >= kSmallestElement && number.value <= kLargestElement))
      refuse(start,
             fmt::format("a start value from {:g} to {:g}", kSmallestElement, kLargestElement),
             number.text);
    return number.value;
  }

  TextCursor text_;
  std::size_t depth_ = 0;
  SpringDashpotNetwork network_;
};

SpringDashpotNetwork generalised_maxwell(std::size_t branches) {
  std::string text = "parallel(k0";
  for (std::size_t i = 1; i <= branches; ++i) text += fmt::format(", maxwell(k{0}, d{0})", i);
  return Parser(text + ")").parse();
}

std::string element_text(const NetworkNode& node, int digits) {
  if (digits == 0 || std::isnan(node.value)) return node.name();
  return fmt::format("{}={:.{}g}", node.name(), node.value, digits);
}

}  // namespace

std::string NetworkNode::name() const {
  const char* letter = is(NetworkKind::spring) ? "k" : "d";
  return label == 0 ? letter : fmt::format("{}{}", letter, label - 1);
}

std::vector<std::string> SpringDashpotNetwork::names() const {
  std::vector<std::string> names;
  for (const NetworkNode& node : nodes)
    if (node.is_leaf()) names.push_back(node.name());
  return names;
}

std::vector<double> SpringDashpotNetwork::values() const {
  std::vector<double> values;
  for (const NetworkNode& node : nodes)
    if (node.is_leaf()) values.push_back(node.value);
  return values;
}

void SpringDashpotNetwork::set_values(const std::vector<double>& values) {
  std::size_t next = 0;
  for (NetworkNode& node : nodes)
    if (node.is_leaf()) node.value = values[next++];
}

SpringDashpotNetwork parse_network(std::string_view text) {
  const std::string_view name = trimmed(text);
  if (const auto* const preset = std::ranges::find(kPresets, name, &Preset::name);
      preset != kPresets.end()) {
    SpringDashpotNetwork network = Parser(preset->text).parse();
    for (NetworkNode& node : network.nodes) node.value *= preset->scale;
    return network;
  }
  if (const std::size_t branches = Parser(text).branches(); branches > 0)
    return generalised_maxwell(branches);
  if (name.empty())
    throw UsageError(
        {.place = "network",
         .expected = "a network like series(kv(k1, d1), k2), or one of " + preset_names(),
         .found = "nothing"});
  try {
    return Parser(text).parse();
  } catch (const UsageError& error) {
    // A single word was most likely meant as a name.
    if (!std::ranges::all_of(name, is_word_character)) throw;
    ErrorReport report = error.report();
    report.expected += ", or one of " + preset_names();
    throw UsageError(std::move(report));
  }
}

std::string text_of(const SpringDashpotNetwork& network, int digits) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < network.nodes.size(); ++i) {
    const NetworkNode& node = network.nodes[i];
    if (node.is_leaf()) {
      parts.push_back(element_text(node, digits));
      continue;
    }
    if (node.children > parts.size()) return "?";
    const bool is_pair = node.children == 2 && i >= 2 &&
                         network.nodes[i - 2].is(NetworkKind::spring) &&
                         network.nodes[i - 1].is(NetworkKind::dashpot);
    const bool is_series = node.is(NetworkKind::series);
    std::string text =
        is_pair ? (is_series ? "maxwell(" : "kv(") : (is_series ? "series(" : "parallel(");
    const auto first = parts.end() - static_cast<std::ptrdiff_t>(node.children);
    for (auto part = first; part != parts.end(); ++part)
      text += part == first ? *part : ", " + *part;
    parts.erase(first, parts.end());
    parts.push_back(text + ')');
  }
  return parts.size() == 1 ? parts.front() : "?";
}

}  // namespace torsio
