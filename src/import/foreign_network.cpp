#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "import/network_parameters.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

// A layer that passes its inputs on has their number squared in weights.
constexpr std::size_t kMaxIdentity = 1024;

struct ActivatedDense {
  DenseStage map;
  Activation activation = Activation::linear;
};

Matrix identity(std::size_t size) {
  Matrix matrix(size, size);
  for (std::size_t i = 0; i < size; ++i) matrix(i, i) = 1.0;
  return matrix;
}

/// W (gain x + offset) + b as W' x + b'.
void absorb(const AffineStage& before, Matrix& weights, std::vector<double>& bias) {
  for (std::size_t row = 0; row < weights.rows; ++row)
    for (std::size_t j = 0; j < weights.columns; ++j) {
      bias[row] += weights(row, j) * before.offset[j];
      weights(row, j) *= before.gain[j];
    }
}

/// W (V x + v) + b as W' x + b'.
void absorb(const DenseStage& before, Matrix& weights, std::vector<double>& bias) {
  Matrix product(weights.rows, before.weights.columns);
  for (std::size_t row = 0; row < weights.rows; ++row)
    for (std::size_t k = 0; k < weights.columns; ++k) {
      bias[row] += weights(row, k) * before.bias[k];
      for (std::size_t j = 0; j < product.columns; ++j)
        product(row, j) += weights(row, k) * before.weights(k, j);
    }
  weights = std::move(product);
}

/// gain (W x + b) + offset as W' x + b'.
void absorb_after(const AffineStage& after, DenseStage& dense) {
  for (std::size_t row = 0; row < dense.weights.rows; ++row) {
    for (double& weight : dense.weights.row(row)) weight *= after.gain[row];
    dense.bias[row] = after.gain[row] * dense.bias[row] + after.offset[row];
  }
}

bool is_positive(const AffineStage& stage) {
  return std::ranges::all_of(stage.gain, [](double gain) { return gain > 0.0; });
}

bool is_offset_only(const AffineStage& stage) {
  return std::ranges::all_of(stage.gain, [](double gain) { return gain == 1.0; });
}

/// Turns stages into standardisation, recurrent layers and dense layers, in this order.
class Assembly {
 public:
  explicit Assembly(const ForeignNetwork& network) : network_(network), width_(network.inputs) {
    scaling_.inputs = {std::vector<double>(width_, 0.0), std::vector<double>(width_, 1.0)};
    for (const ForeignStage& stage : network.stages)
      std::visit([this](const auto& one) { add(one); }, stage);
    finish();
  }

  [[nodiscard]] AnyModel::Parameters parameters(double period_s, std::size_t warm_up) const {
    if (recurrent_.empty()) return Mlp::Parameters{scaling_, dense_layers()};
    if (recurrent_.front().kind == RecurrentStage::Kind::gru)
      return Gru::Parameters{scaling_, gru_layers(), dense_layers(), period_s, warm_up};
    return Lstm::Parameters{scaling_, lstm_layers(), dense_layers(), period_s, warm_up};
  }

 private:
  [[nodiscard]] bool is_at_start() const { return recurrent_.empty() && dense_.empty(); }
  [[nodiscard]] bool ends_linear() const {
    return !dense_.empty() && dense_.back().activation == Activation::linear;
  }

  void add(const AffineStage& stage) {
    if (pending_) {
      for (std::size_t j = 0; j < width_; ++j) {
        pending_->offset[j] = stage.gain[j] * pending_->offset[j] + stage.offset[j];
        pending_->gain[j] *= stage.gain[j];
      }
    } else if (ends_linear() && is_offset_only(stage)) {
      absorb_after(stage, dense_.back().map);  // the bias of a bare product
    } else {
      pending_ = stage;
    }
  }

  void add(DenseStage stage) {
    take_pending(stage.weights, stage.bias);
    width_ = stage.weights.rows;
    dense_.push_back({std::move(stage)});
  }

  void add(const ActivationStage& stage) {
    if (stage.function == Activation::linear) return;
    if (!ends_linear()) {
      if (width_ > kMaxIdentity)
        throw Error({.problem = "an activation without a layer before it, too wide to make one",
                     .expected = fmt::format("at most {} units", kMaxIdentity),
                     .found = fmt::format("{}", width_)});
      add(DenseStage{identity(width_), std::vector<double>(width_, 0.0)});
    } else if (pending_) {
      absorb_after(*std::exchange(pending_, std::nullopt), dense_.back().map);
    }
    dense_.back().activation = stage.function;
  }

  void add(RecurrentStage stage) {
    if (!recurrent_.empty() && recurrent_.front().kind != stage.kind)
      refuse("recurrent layers of one kind", "LSTM and GRU in one network");
    take_pending(stage.input_weights, stage.input_bias);
    for (; !dense_.empty(); dense_.pop_back()) {
      if (dense_.back().activation != Activation::linear)
        refuse("recurrent layers in front of dense ones",
               "a dense layer with an activation in front of a recurrent one");
      absorb(dense_.back().map, stage.input_weights, stage.input_bias);
    }
    width_ = stage.recurrent_weights.columns;
    recurrent_.push_back(std::move(stage));
  }

  /// What waits in front of a layer becomes standardisation, or part of the layer.
  void take_pending(Matrix& weights, std::vector<double>& bias) {
    if (!pending_) return;
    const AffineStage before = *std::exchange(pending_, std::nullopt);
    if (!is_at_start() || !is_positive(before)) return absorb(before, weights, bias);
    for (std::size_t j = 0; j < width_; ++j) {
      scaling_.inputs.centre[j] = 0.0 - before.offset[j] / before.gain[j];  // no -0
      scaling_.inputs.scale[j] = 1.0 / before.gain[j];
    }
  }

  void finish() {
    if (width_ != 1)
      refuse("one output", fmt::format("{}", width_),
             "torsio estimates one quantity: remove the others before exporting.");
    if (is_at_start()) refuse("at least one layer with weights", "none");
    const std::optional<AffineStage> after = std::exchange(pending_, std::nullopt);
    if (!ends_linear()) add(DenseStage{identity(1), {0.0}});
    if (!after) return;
    if (is_positive(*after)) {
      scaling_.target_scale = after->gain.front();
      scaling_.target_centre = after->offset.front();
    } else {
      absorb_after(*after, dense_.back().map);
    }
  }

  [[noreturn]] void refuse(std::string expected, std::string found, std::string advice = {}) const {
    throw Error({.place = network_.place,
                 .expected = std::move(expected),
                 .found = std::move(found),
                 .advice = std::move(advice)});
  }

  [[nodiscard]] float single(double weight) const {
    // Rounding to infinity starts half a step above the largest number.
    if (!(std::abs(weight) <= static_cast<double>(std::numeric_limits<float>::max())))
      refuse("weights that float32 can hold", fmt::format("{:g}", weight));
    return static_cast<float>(weight);
  }
  [[nodiscard]] std::vector<float> single(const std::vector<double>& values) const {
    std::vector<float> rounded;
    rounded.reserve(values.size());
    for (const double value : values) rounded.push_back(single(value));
    return rounded;
  }
  [[nodiscard]] FloatMatrix single(const Matrix& matrix) const {
    FloatMatrix rounded;
    rounded.rows = matrix.rows;
    rounded.columns = matrix.columns;
    rounded.values = single(matrix.values);
    return rounded;
  }

  [[nodiscard]] std::vector<DenseLayer> dense_layers() const {
    std::vector<DenseLayer> layers;
    for (const ActivatedDense& dense : dense_)
      layers.push_back({single(dense.map.weights), single(dense.map.bias),
                        static_cast<std::size_t>(dense.activation)});
    return layers;
  }
  [[nodiscard]] std::vector<LstmLayer> lstm_layers() const {
    std::vector<LstmLayer> layers;
    for (const RecurrentStage& stage : recurrent_) {
      std::vector<double> bias = stage.input_bias;
      const auto is_zero = [](double value) { return value == 0.0; };
      if (network_.fold_biases || std::ranges::all_of(stage.recurrent_bias, is_zero)) {
        for (std::size_t i = 0; i < bias.size(); ++i) bias[i] += stage.recurrent_bias[i];
      } else {
        bias.insert(bias.end(), stage.recurrent_bias.begin(), stage.recurrent_bias.end());
      }
      layers.push_back(
          {single(stage.input_weights), single(stage.recurrent_weights), single(bias)});
    }
    return layers;
  }
  [[nodiscard]] std::vector<GruLayer> gru_layers() const {
    std::vector<GruLayer> layers;
    for (const RecurrentStage& stage : recurrent_)
      layers.push_back({single(stage.input_weights), single(stage.recurrent_weights),
                        single(stage.input_bias), single(stage.recurrent_bias)});
    return layers;
  }

  const ForeignNetwork& network_;
  std::size_t width_;
  NetworkScaling scaling_;
  std::vector<RecurrentStage> recurrent_;
  std::vector<ActivatedDense> dense_;   ///< after the last recurrent layer so far
  std::optional<AffineStage> pending_;  ///< after the last layer so far
};

}  // namespace

AnyModel::Parameters network_parameters(const ForeignNetwork& network, double sample_period_s,
                                        std::size_t warm_up_samples) {
  return Assembly(network).parameters(sample_period_s, warm_up_samples);
}

}  // namespace torsio
