#include "files/leaf_tensors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestEmpty = 65536;

[[noreturn]] void refuse_tensor(const ErrorPlace& place, std::string_view expected,
                                std::string_view found) {
  refuse(place, expected, found,
         "The contents of the file do not match its card: fit the model again.");
}

/// The values of a tensor that must have that element type and number of dimensions.
template <class T>
const std::vector<T>& values_of(const Tensor& tensor, const std::string& place,
                                std::size_t dimensions, std::string_view wanted) {
  const auto* values = std::get_if<std::vector<T>>(&tensor.values);
  if (values == nullptr) refuse_tensor(place, std::string(wanted), "another element type");
  if (tensor.shape.size() != dimensions)
    refuse_tensor(place, std::string(wanted), fmt::format("shape {}", shape_text(tensor.shape)));
  return *values;
}

void check_numbers(const Tensor& tensor, const std::string& place, bool may_be_nan) {
  std::visit(
      [&]<class Number>(const std::vector<Number>& values) {
        if constexpr (std::floating_point<Number>) {
          const auto bad = std::ranges::find_if_not(values, [&](Number value) {
            return std::isfinite(value) || (may_be_nan && std::isnan(value));
          });
          if (bad != values.end())
            refuse_tensor(place, "finite numbers",
                          fmt::format("{} at index {}", *bad, bad - values.begin()));
        }
      },
      tensor.values);
}

template <class Number>
Tensor table_tensor(const detail::Table2d<Number>& table) {
  return {.shape = {table.rows, table.columns}, .values = table.values};
}

template <class Number>
void read_table(const Tensor& tensor, const std::string& place, std::string_view wanted,
                detail::Table2d<Number>& table) {
  table.values = values_of<Number>(tensor, place, 2, wanted);
  // An empty table has a shape that no file size bounds; a family may take memory by it.
  const std::size_t longest = std::max(tensor.shape[0], tensor.shape[1]);
  if (table.values.empty() && longest > kLongestEmpty)
    refuse_tensor(place, fmt::format("an empty table of at most {} rows or columns", kLongestEmpty),
                  shape_text(tensor.shape));
  table.rows = tensor.shape[0];
  table.columns = tensor.shape[1];
}

}  // namespace

Tensor tensor_of(double value) { return {.shape = {}, .values = std::vector{value}}; }
Tensor tensor_of(bool value) {
  return {.shape = {}, .values = std::vector{static_cast<std::uint8_t>(value ? 1 : 0)}};
}
Tensor tensor_of(std::size_t value) {
  return {.shape = {}, .values = std::vector{static_cast<std::int64_t>(value)}};
}
Tensor tensor_of(const std::vector<double>& values) {
  return {.shape = {values.size()}, .values = values};
}
Tensor tensor_of(const std::vector<float>& values) {
  return {.shape = {values.size()}, .values = values};
}
Tensor tensor_of(const Matrix& values) { return table_tensor(values); }
Tensor tensor_of(const FloatMatrix& values) { return table_tensor(values); }

void read_tensor(const Tensor& tensor, const std::string& place, double& value) {
  value = values_of<double>(tensor, place, 0, "one F64 of shape []").front();
}

void read_tensor(const Tensor& tensor, const std::string& place, bool& value) {
  const std::uint8_t number =
      values_of<std::uint8_t>(tensor, place, 0, "one U8 of shape []").front();
  if (number > 1) refuse_tensor(place, "0 or 1", fmt::format("{}", number));
  value = number == 1;
}

void read_tensor(const Tensor& tensor, const std::string& place, std::size_t& value) {
  const std::int64_t number =
      values_of<std::int64_t>(tensor, place, 0, "one I64 of shape []").front();
  if (number < 0) refuse_tensor(place, "a number from 0", fmt::format("{}", number));
  value = static_cast<std::size_t>(number);
}

void read_tensor(const Tensor& tensor, const std::string& place, std::vector<double>& values) {
  values = values_of<double>(tensor, place, 1, "F64 of shape [n]");
}

void read_tensor(const Tensor& tensor, const std::string& place, std::vector<float>& values) {
  values = values_of<float>(tensor, place, 1, "F32 of shape [n]");
}

void read_tensor(const Tensor& tensor, const std::string& place, Matrix& values) {
  read_table(tensor, place, "F64 of shape [rows, columns]", values);
}

void read_tensor(const Tensor& tensor, const std::string& place, FloatMatrix& values) {
  read_table(tensor, place, "F32 of shape [rows, columns]", values);
}

std::size_t list_size(const Safetensors& contents, const std::string& name, std::string_view file) {
  const std::string prefix = name + ".";
  std::vector<bool> seen;
  for (auto at = contents.tensors.lower_bound(prefix);
       at != contents.tensors.end() && at->first.starts_with(prefix); ++at) {
    const std::string_view rest = std::string_view(at->first).substr(prefix.size());
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), index);
    // It is not an element; it is either another field or unknown.
    if (error != std::errc() || end == rest.data() + rest.size() || *end != '.') continue;
    if (index >= kMaxElements)
      refuse_tensor(fmt::format("{}: /{}", file, at->first),
                    fmt::format("at most {} elements of {}", kMaxElements, name),
                    fmt::format("one of index {}", index));
    if (index >= seen.size()) seen.resize(index + 1);
    seen[index] = true;
  }
  const auto missing = std::ranges::find(seen, false);
  if (missing != seen.end())
    refuse_tensor(fmt::format("{}: /{}.{}", file, name, missing - seen.begin()),
                  "a tensor of that name", fmt::format("none, but {}.{}", name, seen.size() - 1));
  return seen.size();
}

bool has_tensors_of(const Safetensors& contents, const std::string& name) {
  const std::string prefix = name + ".";
  const auto first = contents.tensors.lower_bound(prefix);
  return first != contents.tensors.end() && first->first.starts_with(prefix);
}

std::size_t alternative_index(const Safetensors& contents, const std::string& name,
                              std::span<const std::string_view> alternatives,
                              std::string_view file) {
  const std::string prefix = name + ".";
  std::vector<std::string_view> named;
  std::ranges::copy_if(alternatives, std::back_inserter(named), [](auto n) { return !n.empty(); });
  const std::string expected = fmt::format("tensors of one of {}", fmt::join(named, ", "));
  auto chosen = alternatives.end();
  for (auto at = contents.tensors.lower_bound(prefix);
       at != contents.tensors.end() && at->first.starts_with(prefix); ++at) {
    const std::string_view rest = std::string_view(at->first).substr(prefix.size());
    const std::string_view alternative = rest.substr(0, rest.find('.'));
    const std::string place = fmt::format("{}: /{}", file, at->first);
    const auto found = std::ranges::find(alternatives, alternative);
    if (alternative.empty() || alternative.size() == rest.size() || found == alternatives.end())
      refuse_tensor(place, expected, fmt::format("'{}'", alternative));
    if (chosen != alternatives.end() && chosen != found)
      refuse_tensor(place, expected, fmt::format("{} and {}", *chosen, *found));
    chosen = found;
  }
  if (chosen == alternatives.end()) chosen = std::ranges::find(alternatives, std::string_view());
  if (chosen == alternatives.end())
    refuse_tensor(fmt::format("{}: /{}", file, name), expected, "none");
  return static_cast<std::size_t>(chosen - alternatives.begin());
}

Tensor take_tensor(Safetensors& contents, const std::string& name, std::string_view file,
                   bool may_be_nan) {
  auto node = contents.tensors.extract(name);
  const std::string place = fmt::format("{}: /{}", file, name);
  if (node.empty()) refuse_tensor(place, "a tensor", "none");
  check_numbers(node.mapped(), place, may_be_nan);
  return std::move(node.mapped());
}

}  // namespace torsio
