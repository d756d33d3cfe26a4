// What moves numbers about without changing them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "import/graph_evaluator.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio::graph {
namespace {

/// What exporters write for "to the end".
constexpr std::int64_t kToTheEnd = std::numeric_limits<std::int32_t>::max();

template <class T>
bool is(const Value& value) {
  return std::holds_alternative<T>(value);
}

/// Zeros and states stay such wherever they are moved.
bool has_no_shape(const Value& value) { return is<Zeros>(value) || is<State>(value); }

std::vector<std::int64_t> without(std::vector<std::int64_t> shape,
                                  const std::vector<std::size_t>& axes) {
  std::vector<std::int64_t> rest;
  for (std::size_t i = 0; i < shape.size(); ++i)
    if (std::ranges::find(axes, i) == axes.end()) rest.push_back(shape[i]);
  return rest;
}

/// `begin` or `end` of a slice on an axis of known size.
std::int64_t clamped(std::int64_t index, std::int64_t size) {
  return std::clamp(index < 0 ? index + size : index, std::int64_t{0}, size);
}

}  // namespace

Value Evaluator::identity(const Node& node) {
  const Value& value = input(node, 0);
  if (const auto* const tensor = std::get_if<Tensor>(&value)) return copy_of(node, *tensor);
  return value;
}

Value Evaluator::cast(const Node& node) {
  constexpr std::int64_t kFloat = 1;
  constexpr std::int64_t kDouble = 11;
  const Value& value = input(node, 0);
  const std::int64_t to = integer(node, "to", 0);
  if (is<Signal>(value) && to != kFloat && to != kDouble)
    refuse(graph_, node, "float or double", fmt::format("type {}", to));
  return identity(node);
}

Value Evaluator::dropout(const Node& node) {
  if (has_input(node, 2) && constant(node, 2).values != std::vector<double>{0.0})
    refuse(graph_, node, "inference", "training");
  return identity(node);
}

Value Evaluator::constant_node(const Node& node) {
  for (const char* name : {"value", "value_float", "value_floats", "value_int", "value_ints"}) {
    const auto found = node.attributes.find(name);
    if (found == node.attributes.end()) continue;
    const Attribute& value = found->second;
    if (value.tensor) return copy_of(node, *value.tensor);
    const bool is_list = std::string_view(name).ends_with('s');
    Tensor tensor{{}, value.numbers};
    tensor.values.insert(tensor.values.end(), value.integers.begin(), value.integers.end());
    if (is_list) tensor.shape.push_back(static_cast<std::int64_t>(tensor.values.size()));
    if (is_list || tensor.values.size() == 1) return copy_of(node, tensor);
  }
  refuse(graph_, node, "numbers", "something else");
}

Value Evaluator::constant_of_shape(const Node& node) {
  const auto value = node.attributes.find("value");
  if (value != node.attributes.end() && value->second.tensor &&
      value->second.tensor->values != std::vector<double>{0.0})
    refuse(graph_, node, "zeros", "other numbers");
  return Zeros{};
}

Value Evaluator::shape(const Node& node) {
  if (node.attributes.contains("start") || node.attributes.contains("end"))
    refuse(graph_, node, "the whole shape", "a part of it");
  const Value& value = input(node, 0);
  Tensor sizes;
  if (const auto* const tensor = std::get_if<Tensor>(&value)) {
    sizes.values.assign(tensor->shape.begin(), tensor->shape.end());
  } else if (const auto* const signal = std::get_if<Signal>(&value)) {
    for (const Axis& axis : signal->axes) {
      if (axis.size() > 1)
        sizes.values.push_back(kNotMeasured);
      else if (axis.empty())
        sizes.values.push_back(1.0);
      else
        sizes.values.push_back(axis.front().size ? static_cast<double>(*axis.front().size)
                                                 : symbol_of(axis.front().label));
    }
  } else {
    refuse(graph_, node, "the shape of the network's input or of a constant", "another one");
  }
  sizes.shape.push_back(static_cast<std::int64_t>(sizes.values.size()));
  return sizes;
}

Value Evaluator::expand(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const auto* const tensor = std::get_if<Tensor>(&value);
  if (tensor == nullptr || !std::ranges::all_of(tensor->values, [](double x) { return x == 0.0; }))
    refuse(graph_, node, "zeros", "something else");
  return Zeros{};
}

Signal Evaluator::last_sample(const Node& node, Signal signal, std::size_t axis, std::int64_t index,
                              bool keeps_axis) const {
  const Axis& parts = signal.axes[axis];
  const bool is_last =
      parts.empty() ? index == 0 || index == -1
                    : parts.size() == 1 && signal.time == parts.front().label &&
                          (index == -1 || (parts.front().size && index == *parts.front().size - 1));
  if (!is_last)
    refuse(graph_, node, "the last sample along the time of a recurrent layer",
           fmt::format("index {} of axis {}", index, axis),
           "Inputs are selected and ordered by --inputs, not in the graph.");
  signal.is_last_sample = signal.is_last_sample || !parts.empty();
  if (keeps_axis)
    signal.axes[axis].clear();
  else
    signal.axes.erase(signal.axes.begin() + static_cast<std::ptrdiff_t>(axis));
  return signal;
}

Value Evaluator::gather(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const Tensor& chosen = constant(node, 1);
  const std::vector<std::int64_t> indices = whole_numbers(node, 1);
  const std::int64_t axis = integer(node, "axis", 0);
  if (const auto* const from = std::get_if<Signal>(&value)) {
    if (indices.size() != 1 || chosen.shape.size() > 1)
      refuse(graph_, node, "one sample", fmt::format("{} indices", indices.size()));
    return last_sample(node, *from, axis_of(graph_, node, axis, from->axes.size()), indices.front(),
                       !chosen.shape.empty());
  }
  const Tensor& from = constant(node, 0);
  const std::size_t along = axis_of(graph_, node, axis, from.shape.size());
  if (chosen.shape.size() > 1) refuse(graph_, node, "a list of indices", "a table");
  std::vector<std::size_t> places;
  for (const std::int64_t index : indices) {
    const std::int64_t size = from.shape[along];
    if (index < -size || index >= size)
      refuse(graph_, node, fmt::format("indices below {}", size), fmt::format("{}", index));
    places.push_back(static_cast<std::size_t>(index < 0 ? index + size : index));
  }
  Tensor result = taken_from(node, from, along, places);
  if (chosen.shape.empty()) result.shape = without(std::move(result.shape), {along});
  return result;
}

Value Evaluator::slice(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const auto starts = whole_numbers(node, 1, "starts");
  const auto ends = whole_numbers(node, 2, "ends");
  auto axes = whole_numbers(node, 3, "axes");
  const auto steps = whole_numbers(node, 4, "steps");
  if (!starts || !ends || starts->size() != ends->size() ||
      (axes && axes->size() != starts->size()))
    refuse(graph_, node, "a start and an end for each axis", "another number of them");
  if (!axes) {
    axes.emplace();
    for (std::size_t i = 0; i < starts->size(); ++i) axes->push_back(static_cast<std::int64_t>(i));
  }
  if (steps && std::ranges::any_of(*steps, [](std::int64_t step) { return step != 1; }))
    refuse(graph_, node, "steps of 1", "others");
  Value result = value;
  for (std::size_t i = 0; i < starts->size(); ++i) {
    const std::int64_t start = (*starts)[i];
    const std::int64_t end = (*ends)[i];
    if (auto* const signal = std::get_if<Signal>(&result)) {
      const std::size_t axis = axis_of(graph_, node, (*axes)[i], signal->axes.size());
      const Axis& parts = signal->axes[axis];
      const std::int64_t size = parts.empty()      ? 1
                                : parts.size() > 1 ? kToTheEnd
                                                   : parts.front().size.value_or(kToTheEnd);
      const bool is_to_the_end = end >= size;
      if (start == 0 && is_to_the_end) continue;
      if (!is_to_the_end || (start != -1 && start != size - 1))
        refuse(graph_, node, "all samples or the last one",
               fmt::format("{} to {} of axis {}", start, end, axis),
               "Inputs are selected and ordered by --inputs, not in the graph.");
      *signal = last_sample(node, *signal, axis, start, true);
    } else if (const auto* const tensor = std::get_if<Tensor>(&result)) {
      const std::size_t axis = axis_of(graph_, node, (*axes)[i], tensor->shape.size());
      std::vector<std::size_t> places;
      const std::int64_t size = tensor->shape[axis];
      for (std::int64_t at = clamped(start, size); at < clamped(end, size); ++at)
        places.push_back(static_cast<std::size_t>(at));
      result = taken_from(node, *tensor, axis, places);
    } else {
      refuse(graph_, node, "the network's signal or a constant", "something else");
    }
  }
  return result;
}

Value Evaluator::concat(const Node& node) {
  std::vector<Tensor> tensors;
  std::size_t without_shape = 0;
  for (std::size_t i = 0; i < node.inputs.size(); ++i) {
    const Value& value = input(node, i);
    if (has_no_shape(value)) {
      ++without_shape;
    } else if (const auto* const tensor = std::get_if<Tensor>(&value)) {
      tensors.push_back(copy_of(node, *tensor));
    }
  }
  if (without_shape == node.inputs.size() && without_shape > 0) return input(node, 0);
  if (tensors.empty() || tensors.size() != node.inputs.size())
    refuse(graph_, node, "constants", "signals that are joined",
           "A network has one path from its input to its output here.");
  const std::vector<std::int64_t>& shape = tensors.front().shape;
  const std::size_t axis = axis_of(graph_, node, integer(node, "axis", 0), shape.size());
  for (const Tensor& tensor : tensors)
    if (tensor.shape.size() != shape.size() ||
        without(tensor.shape, {axis}) != without(shape, {axis}))
      refuse(graph_, node, "equal sizes along the other axes", "different ones");
  return joined(tensors, axis);
}

Value Evaluator::transpose(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const auto* const from = std::get_if<Signal>(&value);
  const std::size_t rank = from != nullptr ? from->axes.size() : constant(node, 0).shape.size();
  std::vector<std::size_t> order;
  if (const auto given = node.attributes.find("perm"); given != node.attributes.end())
    for (const std::int64_t axis : given->second.integers)
      order.push_back(axis_of(graph_, node, axis, rank));
  else
    for (std::size_t i = rank; i-- > 0;) order.push_back(i);
  std::vector<std::size_t> sorted = order;
  std::ranges::sort(sorted);
  if (order.size() != rank || std::ranges::adjacent_find(sorted) != sorted.end())
    refuse(graph_, node, "every axis once", "another order");
  if (from == nullptr) return transposed(copy_of(node, constant(node, 0)), order);
  Signal result = *from;
  for (std::size_t i = 0; i < rank; ++i) result.axes[i] = from->axes[order[i]];
  return result;
}

Value Evaluator::squeeze(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const auto* const from = std::get_if<Signal>(&value);
  const std::size_t rank = from != nullptr ? from->axes.size() : constant(node, 0).shape.size();
  const auto is_one = [&](std::size_t i) {
    return from != nullptr ? from->axes[i].empty() : constant(node, 0).shape[i] == 1;
  };
  std::vector<std::size_t> axes;
  if (const auto given = whole_numbers(node, 1, "axes")) {
    for (const std::int64_t axis : *given) axes.push_back(axis_of(graph_, node, axis, rank));
  } else {
    for (std::size_t i = 0; i < rank; ++i)
      if (is_one(i)) axes.push_back(i);
  }
  for (const std::size_t axis : axes)
    if (!is_one(axis))
      refuse(graph_, node, "axes of size 1", fmt::format("axis {} of another or any size", axis));
  if (from == nullptr) {
    Tensor result = copy_of(node, constant(node, 0));
    result.shape = without(std::move(result.shape), axes);
    return result;
  }
  Signal result = *from;
  result.axes.clear();
  for (std::size_t i = 0; i < rank; ++i)
    if (std::ranges::find(axes, i) == axes.end()) result.axes.push_back(from->axes[i]);
  return result;
}

Value Evaluator::unsqueeze(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const auto given = whole_numbers(node, 1, "axes");
  if (!given) refuse(graph_, node, "axes", "none");
  const auto* const from = std::get_if<Signal>(&value);
  const std::size_t before = from != nullptr ? from->axes.size() : constant(node, 0).shape.size();
  if (given->size() > 8) refuse(graph_, node, "up to 8 axes", fmt::format("{}", given->size()));
  std::vector<std::size_t> axes;
  for (const std::int64_t axis : *given)
    axes.push_back(axis_of(graph_, node, axis, before + given->size()));
  std::ranges::sort(axes);
  if (std::ranges::adjacent_find(axes) != axes.end())
    refuse(graph_, node, "every axis once", "one twice");
  if (from == nullptr) {
    Tensor result = copy_of(node, constant(node, 0));
    for (const std::size_t axis : axes)
      result.shape.insert(result.shape.begin() + static_cast<std::ptrdiff_t>(axis), 1);
    return result;
  }
  Signal result = *from;
  for (const std::size_t axis : axes)
    result.axes.insert(result.axes.begin() + static_cast<std::ptrdiff_t>(axis), Axis{});
  return result;
}

Value Evaluator::reshape(const Node& node) {
  const Value& value = input(node, 0);
  if (has_no_shape(value)) return value;
  const bool zero_means_zero = integer(node, "allowzero", 0) != 0;
  std::vector<double> target = constant(node, 1).values;
  const auto* const from = std::get_if<Signal>(&value);
  if (from != nullptr) {
    for (std::size_t i = 0; i < target.size(); ++i)
      if (target[i] == 0.0 && !zero_means_zero && i < from->axes.size()) {
        const Axis& axis = from->axes[i];
        if (axis.size() > 1) refuse(graph_, node, "sizes of single axes", "one of a merged axis");
        if (axis.empty())
          target[i] = 1.0;
        else
          target[i] = axis.front().size ? static_cast<double>(*axis.front().size)
                                        : symbol_of(axis.front().label);
      }
    const auto axes = reshaped(*from, target);
    if (!axes)
      refuse(graph_, node, "a reshape that keeps samples and channels apart", "another one",
             "A window of samples as inputs of a dense layer: give its samples to --inputs with "
             "lag(x, n), and export the layer alone.");
    Signal result = *from;
    result.axes = *axes;
    return result;
  }
  Tensor result = copy_of(node, constant(node, 0));
  const auto shape = whole_numbers(node, 1);
  std::vector<std::int64_t> sizes = shape;
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (sizes[i] == 0 && !zero_means_zero && i < result.shape.size()) sizes[i] = result.shape[i];
  const auto wild = std::ranges::find(sizes, -1);
  if (wild != sizes.end()) {
    *wild = 1;
    const std::size_t rest = element_count(sizes).value_or(0);
    if (rest > 0) *wild = static_cast<std::int64_t>(result.values.size() / rest);
  }
  if (sizes.size() > 8 || element_count(sizes) != result.values.size())
    refuse(graph_, node, fmt::format("a shape of {} numbers", result.values.size()), "another one");
  result.shape = sizes;
  return result;
}

Value Evaluator::flatten(const Node& node) {
  const Signal& from = signal(node, 0);
  const auto rank = static_cast<std::int64_t>(from.axes.size());
  const std::int64_t at = integer(node, "axis", 1);
  const auto split = static_cast<std::ptrdiff_t>(at < 0 ? at + rank : at);
  if (split < 0 || split > rank)
    refuse(graph_, node, fmt::format("an axis up to {}", rank), fmt::format("{}", at));
  Signal result = from;
  result.axes = {Axis{}, Axis{}};
  for (std::ptrdiff_t i = 0; i < rank; ++i) {
    const Axis& parts = from.axes[static_cast<std::size_t>(i)];
    Axis& to = result.axes[i < split ? 0 : 1];
    to.insert(to.end(), parts.begin(), parts.end());
  }
  const Axis features =
      from.width > 1 ? Axis{{kFeatureLabel, static_cast<std::int64_t>(from.width)}} : Axis{};
  if (result.axes[1] != features)
    refuse(graph_, node, "a flattening that keeps samples and channels apart", "another one");
  return result;
}

}  // namespace torsio::graph
