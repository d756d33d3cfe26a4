#include "model/network/network_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kActivations = static_cast<std::size_t>(Activation::elu) + 1;

template <class Number>
void check_finite(std::span<const Number> values, const std::string& place) {
  const auto bad =
      std::ranges::find_if_not(values, [](Number value) { return std::isfinite(value); });
  if (bad != values.end())
    refuse(place, "finite numbers", fmt::format("{} at index {}", *bad, bad - values.begin()));
}

template <class Number>
void check_table(const detail::Table2d<Number>& matrix, std::size_t rows, std::size_t columns,
                 const std::string& place) {
  const std::size_t count = matrix.values.size();
  if (matrix.rows != rows || matrix.columns != columns)
    refuse(place, fmt::format("{} x {}", rows, columns),
           fmt::format("{} x {}", matrix.rows, matrix.columns));
  if (count != rows * columns)
    refuse(place, fmt::format("{} numbers", rows * columns), fmt::format("{}", count));
  check_finite(std::span(matrix.values), place);
}

template <class Number>
void check_list(const std::vector<Number>& values, std::size_t length, const std::string& place) {
  if (values.size() != length)
    refuse(place, fmt::format("{} numbers", length), fmt::format("{}", values.size()));
  check_finite(std::span(values), place);
}

/// Before anything is multiplied.
std::size_t checked_units(std::size_t rows, std::size_t gates, const std::string& place) {
  if (rows == 0 || rows % gates != 0 || rows / gates > kMaxUnits)
    refuse(place,
           gates == 1 ? fmt::format("1 to {} rows", kMaxUnits)
                      : fmt::format("{} rows for each of 1 to {} units", gates, kMaxUnits),
           fmt::format("{} rows", rows));
  return rows / gates;
}

/// Both matrices of a recurrent layer. @returns their rows, gates times units
template <class Layer>
std::size_t checked_rows(const Layer& layer, std::size_t gates, std::size_t inputs,
                         const std::string& place) {
  const std::string recurrent = place + ".recurrent_weights";
  const std::size_t units = checked_units(layer.recurrent_weights.rows, gates, recurrent);
  check_table(layer.recurrent_weights, gates * units, units, recurrent);
  check_table(layer.input_weights, gates * units, inputs, place + ".input_weights");
  return gates * units;
}

}  // namespace

std::size_t checked_input_count(const NetworkScaling& scaling, const std::string& place) {
  const auto& [centre, scale] = scaling.inputs;
  if (centre.empty() || centre.size() > kMaxUnits)
    refuse(place + ".inputs.centre", fmt::format("1 to {} inputs", kMaxUnits),
           fmt::format("{}", centre.size()));
  if (scale.size() != centre.size())
    refuse(place + ".inputs.scale", fmt::format("{} numbers", centre.size()),
           fmt::format("{}", scale.size()));
  check_finite(std::span(centre), place + ".inputs.centre");
  for (std::size_t j = 0; j < scale.size(); ++j)
    check_positive(scale[j], fmt::format("{}.inputs.scale[{}]", place, j));
  check_finite(std::span(&scaling.target_centre, 1), place + ".target_centre");
  check_positive(scaling.target_scale, place + ".target_scale");
  return centre.size();
}

void check_layer_count(std::size_t count, const std::string& place) {
  if (count == 0 || count > kMaxLayers)
    refuse(place, fmt::format("1 to {} layers", kMaxLayers), fmt::format("{}", count));
}

void check_layer(const DenseLayer& layer, std::size_t inputs, const std::string& place) {
  const std::size_t units = checked_units(layer.weights.rows, 1, place + ".weights");
  check_table(layer.weights, units, inputs, place + ".weights");
  check_list(layer.bias, units, place + ".bias");
  if (layer.activation >= kActivations)
    refuse(place + ".activation", fmt::format("a number below {}", kActivations),
           fmt::format("{}", layer.activation));
}

void check_layer(const LstmLayer& layer, std::size_t inputs, const std::string& place) {
  const std::size_t rows = checked_rows(layer, 4, inputs, place);
  check_list(layer.bias, layer.keeps_biases_apart() ? 2 * rows : rows, place + ".bias");
}

void check_layer(const GruLayer& layer, std::size_t inputs, const std::string& place) {
  const std::size_t rows = checked_rows(layer, 3, inputs, place);
  check_list(layer.input_bias, rows, place + ".input_bias");
  check_list(layer.recurrent_bias, rows, place + ".recurrent_bias");
}

void check_last_layer(const DenseLayer& layer, const std::string& place) {
  if (layer.weights.rows != 1)
    refuse(place + ".weights", "one output of the last layer",
           fmt::format("{}", layer.weights.rows));
  if (layer.activation != static_cast<std::size_t>(Activation::linear))
    refuse(place + ".activation", "a linear last layer",
           std::string(name(static_cast<Activation>(layer.activation))));
}

void check_positive(double value, const std::string& place) {
  require(std::isfinite(value) && value > 0.0, place, "a positive, finite number", value);
}

void check_shape(const Matrix& matrix, std::size_t rows, std::size_t columns,
                 const std::string& place) {
  check_table(matrix, rows, columns, place);
}

void check_length(const std::vector<double>& values, std::size_t length, const std::string& place) {
  check_list(values, length, place);
}

}  // namespace torsio
