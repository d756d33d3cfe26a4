#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "core/text_cursor.hpp"
#include "core/trimmed.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

/// Rewrites the numbers of samples in an expression that a pipeline has accepted.
class LagWriter {
 public:
  LagWriter(double from_Hz, double to_Hz) : from_Hz_(from_Hz), to_Hz_(to_Hz) {}

  [[nodiscard]] std::string rewritten(std::string_view text) const {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
      if (!is_word_character(text[i])) {
        result += text[i++];
        continue;
      }
      std::size_t end = i;
      while (end < text.size() && is_word_character(text[end])) ++end;
      const std::string_view name = text.substr(i, end - i);
      result += name;
      i = end;
      const std::size_t open = text.find_first_not_of(" \t", end);
      if (name != "lag" || open == std::string_view::npos || text[open] != '(') continue;
      const auto [comma, close] = arguments_from(text, open);
      const std::string_view whole =
          text.substr(end - name.size(), close + 1 - (end - name.size()));
      result += fmt::format("({}, {})", rewritten(text.substr(open + 1, comma - open - 1)),
                            distance(trimmed(text.substr(comma + 1, close - comma - 1)), whole));
      i = close + 1;
    }
    return result;
  }

 private:
  /// The last comma between the parentheses, and the closing one.
  static std::pair<std::size_t, std::size_t> arguments_from(std::string_view text,
                                                            std::size_t open) {
    std::size_t comma = open;
    int depth = 0;
    for (std::size_t i = open; i < text.size(); ++i) {
      if (text[i] == '(') ++depth;
      if (text[i] == ',' && depth == 1) comma = i;
      if (text[i] == ')' && --depth == 0) return {comma, i};
    }
    return {comma, text.size()};  // no pipeline accepts it
  }

  [[nodiscard]] std::string distance(std::string_view written, std::string_view lag) const {
    double samples = 0.0;
    const auto [end, error] =
        std::from_chars(written.data(), written.data() + written.size(), samples);
    if (error != std::errc() || end != written.data() + written.size()) {
      if (written.find_first_of("abcdefghijklmnopqrstuvwxyz") != std::string_view::npos)
        return std::string(written);  // a time
      throw Error(
          {.place = fmt::format("'{}'", lag),
           .problem = "a model with this input runs at the sample rate of its training only",
           .expected = "one number of samples, or a time like 10ms",
           .found = fmt::format("'{}'", written)});
    }
    constexpr double kRounding = 1e-3;  // a rate is measured
    const double wanted = samples * to_Hz_ / from_Hz_;
    const double whole = std::round(wanted);
    if (std::abs(wanted - whole) > kRounding * std::max(1.0, wanted))
      throw Error({.place = fmt::format("'{}'", lag),
                   .problem = "the lag is not a whole number of samples at this sample rate",
                   .expected = fmt::format("a multiple of {:g} ms", 1e3 / to_Hz_),
                   .found = fmt::format("{:g} ms, {:g} samples at the {:.6g} Hz of the training",
                                        1e3 * samples / from_Hz_, samples, from_Hz_),
                   .advice = fmt::format(
                       "Read the recordings at {:.6g} Hz (--rate), or train with lags that are "
                       "whole at both rates.",
                       from_Hz_)});
    return fmt::format("{:.0f}", whole);
  }

  double from_Hz_;
  double to_Hz_;
};

}  // namespace

FeatureSpec at_sample_rate(FeatureSpec spec, double from_Hz, double to_Hz) {
  const LagWriter writer(from_Hz, to_Hz);
  for (std::string& input : spec.inputs) input = writer.rewritten(input);
  for (ChannelDefinition& each : spec.definitions)
    each.expression = writer.rewritten(each.expression);
  return spec;
}

}  // namespace torsio
