#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "import/graph.hpp"

namespace torsio::graph {

/// One of the graph's input axes, unless its size is 1.
struct Part {
  int label = 0;
  std::optional<std::int64_t> size;  ///< none: any
  bool operator==(const Part&) const = default;
};
inline constexpr int kFeatureLabel = -1;
inline constexpr int kUnitLabel = -2;

/// Input axes merged into one by a reshape; none: an axis of size 1.
using Axis = std::vector<Part>;

/// What came of the graph's input after some stages.
struct Signal {
  std::vector<Axis> axes;
  std::size_t width = 0;            ///< features; their axis is of size 1 if there is but one
  std::vector<std::size_t> stages;  ///< stages after the input, as indices
  std::optional<int> time;          ///< the axis that recurrent layers run along
  bool is_last_sample = false;      ///< only the last sample along it
  bool operator==(const Signal&) const = default;
};

/// |x| and 1 + |x|, of which PyTorch's exporter makes softsign.
struct Magnitude {
  Signal signal;
  double added = 0.0;
};

struct Zeros {};  ///< zeros of any shape
struct State {};  ///< a state that the graph is given

using Value = std::variant<Signal, Magnitude, Tensor, Zeros, State>;

/// A size that is unknown when the graph is read is represented in a shape by one of these numbers.
inline constexpr double kFirstSymbol = -1e300;
[[nodiscard]] constexpr double symbol_of(int label) { return kFirstSymbol * (1.0 + label); }
[[nodiscard]] constexpr bool is_symbol(double value) { return value <= kFirstSymbol; }

/// The number of elements, or none if a size is negative or they are more than `kMaxForeignBytes`.
[[nodiscard]] std::optional<std::size_t> element_count(const std::vector<std::int64_t>& shape);

/// The slices `indices` of a tensor along an axis.
[[nodiscard]] Tensor taken(const Tensor& tensor, std::size_t axis,
                           const std::vector<std::size_t>& indices);
[[nodiscard]] Tensor transposed(const Tensor& tensor, const std::vector<std::size_t>& order);
/// Concatenates along an axis; all other sizes are equal.
[[nodiscard]] Tensor joined(const std::vector<Tensor>& tensors, std::size_t axis);

/// The axes after a reshape to `target` (whole numbers, -1 for one that follows, symbols), or none
/// if it is not certain that every sample and channel keeps its place.
[[nodiscard]] std::optional<std::vector<Axis>> reshaped(const Signal& signal,
                                                        const std::vector<double>& target);

}  // namespace torsio::graph
