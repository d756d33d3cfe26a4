#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "signal/expression_graph.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Reads expressions (docs/use/expressions.md) into one graph and puts definitions in where they are
/// named. Text comes from model files and command lines, so length, nesting and lags are limited.
class ExpressionParser {
 public:
  static constexpr std::size_t kLongestExpression = 10'000;  ///< characters
  static constexpr std::size_t kDeepestNesting = 100;        ///< definitions included
  static constexpr std::size_t kLongestLag = 100'000;        ///< samples

  /// Without a sample rate the cut-offs are not checked against it. Keeps references to its
  /// arguments. @throws Error for a definition without a proper name or two of one name.
  ExpressionParser(ExpressionGraph& graph, std::span<const ChannelDefinition> definitions,
                   std::optional<double> sample_rate_Hz);

  /// The node of an expression; `title` is its name in messages: "input". @throws Error
  std::uint32_t parse(std::string_view text, std::string_view title);

  /// Parses the definitions that no expression has used so far, for their mistakes. @throws Error
  void check_unused_definitions();

 private:
  class Reader;
  static constexpr std::uint32_t kUnread = UINT32_MAX;
  static constexpr std::uint32_t kBeingRead = UINT32_MAX - 1;

  std::uint32_t parse_definition(std::size_t index);

  ExpressionGraph& graph_;
  std::span<const ChannelDefinition> definitions_;
  std::map<std::string_view, std::size_t> definition_index_;
  std::vector<std::uint32_t> definition_nodes_;
  std::optional<double> sample_rate_Hz_;
  std::size_t depth_ = 0;
};

}  // namespace torsio
