#include "fit/network/network_initialisation.hpp"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace torsio {
namespace {

void fill_glorot(FloatMatrix& weights, std::size_t inputs, std::size_t outputs, Random& random) {
  const double bound = std::sqrt(6.0 / static_cast<double>(inputs + outputs));
  for (float& weight : weights.values)
    weight = static_cast<float>(bound * (2.0 * random.uniform() - 1.0));
}

/// Each gate's square part of `weights` becomes an orthogonal matrix from the uniform distribution:
/// Q from the QR decomposition of a matrix of normal numbers, signs by the diagonal of R (Mezzadri
/// 2007).
void fill_orthogonal(FloatMatrix& weights, Random& random) {
  const std::size_t units = weights.columns;
  const auto size = static_cast<Eigen::Index>(units);
  for (std::size_t gate = 0; gate < weights.rows / units; ++gate) {
    Eigen::MatrixXd normal(size, size);
    for (Eigen::Index k = 0; k < normal.size(); ++k) normal.data()[k] = random.normal();
    const Eigen::HouseholderQR<Eigen::MatrixXd> decomposition(normal);
    const Eigen::MatrixXd q = decomposition.householderQ();
    for (std::size_t u = 0; u < units; ++u)
      for (std::size_t j = 0; j < units; ++j) {
        const auto row = static_cast<Eigen::Index>(u);
        const auto column = static_cast<Eigen::Index>(j);
        const bool is_flipped = decomposition.matrixQR()(column, column) < 0.0;
        weights(gate * units + u, j) =
            static_cast<float>(is_flipped ? -q(row, column) : q(row, column));
      }
  }
}

}  // namespace

DenseLayer initial_dense(std::size_t inputs, std::size_t units, Activation activation,
                         Random& random) {
  DenseLayer layer{.weights = FloatMatrix(units, inputs),
                   .bias = std::vector<float>(units, 0.0F),
                   .activation = static_cast<std::size_t>(activation)};
  if (activation == Activation::relu || activation == Activation::elu) {
    const double spread = std::sqrt(2.0 / static_cast<double>(inputs));
    for (float& weight : layer.weights.values)
      weight = static_cast<float>(spread * random.normal());
  } else {
    fill_glorot(layer.weights, inputs, units, random);
  }
  return layer;
}

LstmLayer initial_lstm(std::size_t inputs, std::size_t units, Random& random) {
  LstmLayer layer{.input_weights = FloatMatrix(4 * units, inputs),
                  .recurrent_weights = FloatMatrix(4 * units, units),
                  .bias = std::vector<float>(4 * units, 0.0F)};
  fill_glorot(layer.input_weights, inputs, units, random);
  fill_orthogonal(layer.recurrent_weights, random);
  std::fill_n(layer.bias.begin() + static_cast<std::ptrdiff_t>(units), units, 1.0F);
  return layer;
}

GruLayer initial_gru(std::size_t inputs, std::size_t units, Random& random) {
  GruLayer layer{.input_weights = FloatMatrix(3 * units, inputs),
                 .recurrent_weights = FloatMatrix(3 * units, units),
                 .input_bias = std::vector<float>(3 * units, 0.0F),
                 .recurrent_bias = std::vector<float>(3 * units, 0.0F)};
  fill_glorot(layer.input_weights, inputs, units, random);
  fill_orthogonal(layer.recurrent_weights, random);
  return layer;
}

}  // namespace torsio
