#include "import/graph_value.hpp"

#include <algorithm>

namespace torsio::graph {
namespace {

std::size_t product(const std::vector<std::int64_t>& shape, std::size_t begin, std::size_t end) {
  std::size_t count = 1;
  for (std::size_t i = begin; i < end; ++i) count *= static_cast<std::size_t>(shape[i]);
  return count;
}

bool fits(const Part& part, double target, bool is_only_one) {
  if (target == -1.0) return true;
  if (is_symbol(target)) return target == symbol_of(part.label);
  return part.size ? static_cast<double>(*part.size) == target : is_only_one;
}

}  // namespace

std::optional<std::size_t> element_count(const std::vector<std::int64_t>& shape) {
  std::size_t count = 1;  // without sizes of 0, so that no part of a shape overflows either
  for (const std::int64_t size : shape) {
    if (size < 0 || static_cast<std::uint64_t>(size) > kMaxForeignBytes) return std::nullopt;
    count *= std::max(static_cast<std::size_t>(size), std::size_t{1});
    if (count > kMaxForeignBytes) return std::nullopt;
  }
  return std::ranges::find(shape, 0) == shape.end() ? count : 0;
}

Tensor taken(const Tensor& tensor, std::size_t axis, const std::vector<std::size_t>& indices) {
  Tensor result{tensor.shape, {}};
  result.shape[axis] = static_cast<std::int64_t>(indices.size());
  const std::size_t outer = product(tensor.shape, 0, axis);
  const std::size_t inner = product(tensor.shape, axis + 1, tensor.shape.size());
  const auto length = static_cast<std::size_t>(tensor.shape[axis]);
  result.values.reserve(outer * indices.size() * inner);
  for (std::size_t o = 0; o < outer; ++o)
    for (const std::size_t index : indices) {
      const auto begin =
          tensor.values.begin() + static_cast<std::ptrdiff_t>((o * length + index) * inner);
      result.values.insert(result.values.end(), begin, begin + static_cast<std::ptrdiff_t>(inner));
    }
  return result;
}

Tensor transposed(const Tensor& tensor, const std::vector<std::size_t>& order) {
  const std::size_t rank = tensor.shape.size();
  Tensor result{std::vector<std::int64_t>(rank), {}};
  std::vector<std::size_t> strides(rank);
  for (std::size_t i = 0; i < rank; ++i) {
    result.shape[i] = tensor.shape[order[i]];
    strides[i] = product(tensor.shape, order[i] + 1, rank);
  }
  result.values.reserve(tensor.values.size());
  std::vector<std::size_t> at(rank, 0);
  std::size_t from = 0;
  for (std::size_t n = 0; n < tensor.values.size(); ++n) {
    result.values.push_back(tensor.values[from]);
    for (std::size_t i = rank; i-- > 0;) {
      from += strides[i];
      if (++at[i] < static_cast<std::size_t>(result.shape[i])) break;
      from -= strides[i] * at[i];
      at[i] = 0;
    }
  }
  return result;
}

Tensor joined(const std::vector<Tensor>& tensors, std::size_t axis) {
  Tensor result{tensors.front().shape, {}};
  result.shape[axis] = 0;
  for (const Tensor& tensor : tensors) result.shape[axis] += tensor.shape[axis];
  const std::size_t outer = product(result.shape, 0, axis);
  for (std::size_t o = 0; o < outer; ++o)
    for (const Tensor& tensor : tensors) {
      const std::size_t block = tensor.values.size() / outer;
      const auto begin = tensor.values.begin() + static_cast<std::ptrdiff_t>(o * block);
      result.values.insert(result.values.end(), begin, begin + static_cast<std::ptrdiff_t>(block));
    }
  return result;
}

std::optional<std::vector<Axis>> reshaped(const Signal& signal, const std::vector<double>& target) {
  Axis parts;  // all, in their order in memory
  for (const Axis& axis : signal.axes) parts.insert(parts.end(), axis.begin(), axis.end());
  std::vector<double> sizes = target;
  const bool has_features = signal.width > 1;
  bool names_features = true;
  if (has_features) {
    // Only a feature axis that stays the innermost one keeps its channels together.
    if (parts.empty() || parts.back().label != kFeatureLabel || sizes.empty() ||
        !fits(parts.back(), sizes.back(), false))
      return std::nullopt;
    names_features = sizes.back() != -1.0;
    sizes.pop_back();
  }
  const Axis features = has_features ? Axis{parts.back()} : Axis{};
  if (has_features) parts.pop_back();

  const auto real = sizes.size() - static_cast<std::size_t>(std::ranges::count(sizes, 1.0));
  std::vector<Axis> axes;
  std::size_t next = 0;
  for (const double size : sizes) {
    if (size == 1.0 || (parts.empty() && size == -1.0)) {
      axes.emplace_back();
    } else if (real == 1 && size == -1.0 && names_features) {
      axes.push_back(parts);  // samples of all rows one below the other
      next = parts.size();
    } else if (next < parts.size() &&
               fits(parts[next], size, parts.size() == 1 && names_features)) {
      axes.push_back({parts[next++]});
    } else {
      return std::nullopt;
    }
  }
  if (next != parts.size()) return std::nullopt;
  if (has_features) axes.push_back(features);
  return axes;
}

}  // namespace torsio::graph
