#include "files/leaf_tensors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestEmpty = 65536;

[[noreturn]] void refuse(std::string place, std::string expected, std::string found) {
  throw Error({.place = std::move(place),
               .expected = std::move(expected),
               .found = std::move(found),
               .advice = "The file does not hold what its card says: fit the model again."});
}

/// The values of a tensor that must have that element type and number of dimensions.
template <class T>
const std::vector<T>& values_of(const Tensor& tensor, const std::string& place,
                                std::size_t dimensions, std::string_view wanted) {
  const auto* values = std::get_if<std::vector<T>>(&tensor.values);
  if (values == nullptr) refuse(place, std::string(wanted), "another element type");
  if (tensor.shape.size() != dimensions)
    refuse(place, std::string(wanted), fmt::format("shape {}", shape_text(tensor.shape)));
  return *values;
}

void check_numbers(const Tensor& tensor, const std::string& place, bool may_be_nan) {
  const auto* values = std::get_if<std::vector<double>>(&tensor.values);
  if (values == nullptr) return;
  const auto bad = std::ranges::find_if_not(*values, [&](double value) {
    return std::isfinite(value) || (may_be_nan && std::isnan(value));
  });
  if (bad != values->end())
    refuse(place, "finite numbers", fmt::format("{} at index {}", *bad, bad - values->begin()));
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
Tensor tensor_of(const Matrix& values) {
  return {.shape = {values.rows, values.columns}, .values = values.values};
}

void read_tensor(const Tensor& tensor, const std::string& place, double& value) {
  value = values_of<double>(tensor, place, 0, "one F64 of shape []").front();
}

void read_tensor(const Tensor& tensor, const std::string& place, bool& value) {
  const std::uint8_t number =
      values_of<std::uint8_t>(tensor, place, 0, "one U8 of shape []").front();
  if (number > 1) refuse(place, "0 or 1", fmt::format("{}", number));
  value = number == 1;
}

void read_tensor(const Tensor& tensor, const std::string& place, std::size_t& value) {
  const std::int64_t number =
      values_of<std::int64_t>(tensor, place, 0, "one I64 of shape []").front();
  if (number < 0) refuse(place, "a number from 0", fmt::format("{}", number));
  value = static_cast<std::size_t>(number);
}

void read_tensor(const Tensor& tensor, const std::string& place, std::vector<double>& values) {
  values = values_of<double>(tensor, place, 1, "F64 of shape [n]");
}

void read_tensor(const Tensor& tensor, const std::string& place, Matrix& values) {
  values.values = values_of<double>(tensor, place, 2, "F64 of shape [rows, columns]");
  // An empty table has a shape that no file size bounds; a family may take memory by it.
  const std::size_t longest = std::max(tensor.shape[0], tensor.shape[1]);
  if (values.values.empty() && longest > kLongestEmpty)
    refuse(place, fmt::format("an empty table of at most {} rows or columns", kLongestEmpty),
           shape_text(tensor.shape));
  values.rows = tensor.shape[0];
  values.columns = tensor.shape[1];
}

Tensor take_tensor(Safetensors& contents, const std::string& name, std::string_view file,
                   bool may_be_nan) {
  auto node = contents.tensors.extract(name);
  std::string place = fmt::format("{}: /{}", file, name);
  if (node.empty()) refuse(std::move(place), "a tensor", "none");
  check_numbers(node.mapped(), place, may_be_nan);
  return std::move(node.mapped());
}

}  // namespace torsio
