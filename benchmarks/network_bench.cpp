#include <algorithm>
#include <cmath>
#include <concepts>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/common/parameters.hpp"
#include "model/last_layer_adapter.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "rows.hpp"
#include "support/random_network.hpp"

namespace torsio::bench {
namespace {

using test::NetworkShape;

constexpr std::size_t kSteps = 1000;
constexpr std::size_t kTimed =
    20;  // in one run: short enough to be undisturbed on a loaded machine
constexpr std::size_t kJoints = 12;

/// Inputs and outputs are already standardised, so that a peer need not do it.
template <class Network>
typename Network::Parameters plain_network(const NetworkShape& shape) {
  auto parameters = test::random_network<Network>(shape, 1);
  parameters.scaling = {
      .inputs = {.centre = std::vector(shape.inputs, 0.0), .scale = std::vector(shape.inputs, 1.0)},
      .target_centre = 0.0,
      .target_scale = 1.0};
  return parameters;
}

/// Slow oscillations; every joint has its own.
Matrix waves(std::size_t inputs) {
  Matrix features(kSteps, inputs);
  for (std::size_t n = 0; n < kSteps; ++n)
    for (std::size_t j = 0; j < inputs; ++j)
      features(n, j) = std::sin(0.02 * static_cast<double>(n * (j + 3)) + static_cast<double>(j));
  return features;
}

double floor_seconds(std::size_t weights) { return stream_seconds(weights * sizeof(float)); }

template <class Network>
Row step_row(const NetworkShape& shape) {
  Network network(plain_network<Network>(shape));
  const Matrix features = waves(shape.inputs);
  volatile double sink = 0.0;
  const double seconds = best_seconds(
      [&] {
        for (std::size_t n = 0; n < kTimed; ++n) sink = network.step(features.row(n)).value;
      },
      2.0);
  return {.value = seconds / kTimed * 1e6,
          .unit = "us",
          .floor = floor_seconds(network.parameter_count()) * 1e6};
}

class FileOf {
 public:
  explicit FileOf(const char* name) : out_(scratch_folder() / name, std::ios::binary) {
    out_.exceptions(std::ios::failbit | std::ios::badbit);
  }
  template <class Number>
  void write(std::span<const Number> values) {
    out_.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size_bytes()));
  }

 private:
  std::ofstream out_;
};

/// All weights in the order of the fields, then inputs and the outputs of this network.
template <class Network>
void write_network(const NetworkShape& shape) {
  const auto parameters = plain_network<Network>(shape);
  FileOf weights("network.f32");
  for_each_leaf(parameters, [&]<class Leaf>(const std::string&, const Leaf& leaf) {
    if constexpr (std::same_as<Leaf, FloatMatrix>) weights.write(std::span(leaf.values));
    if constexpr (std::same_as<Leaf, std::vector<float>>) weights.write(std::span(leaf));
  });
  const Matrix features = waves(shape.inputs);
  FileOf("network_inputs.f64").write(std::span(features.values));
  Network network(parameters);
  std::vector<double> outputs;
  for (std::size_t n = 0; n < kSteps; ++n) outputs.push_back(network.step(features.row(n)).value);
  FileOf("network_outputs.f64").write(std::span<const double>(outputs));
}

const NetworkShape kLstm250{.units = {250}};
const NetworkShape kLstm32{.units = {32}};
const NetworkShape kGru64{.units = {64}};
const NetworkShape kMlp{.inputs = 3, .hidden = {50, 20, 10}, .activation = Activation::relu};

}  // namespace

Row lstm250_step() { return step_row<Lstm>(kLstm250); }
Row lstm32_step() { return step_row<Lstm>(kLstm32); }
Row gru64_step() { return step_row<Gru>(kGru64); }
Row mlp_step() { return step_row<Mlp>(kMlp); }

void write_lstm250() { write_network<Lstm>(kLstm250); }
void write_lstm32() { write_network<Lstm>(kLstm32); }
void write_gru64() { write_network<Gru>(kGru64); }
void write_mlp() { write_network<Mlp>(kMlp); }

Row lstm250_x12_step() {
  const auto parameters = plain_network<Lstm>(kLstm250);
  RecurrentNetwork<LstmLayer> many(parameters, kJoints, Lstm::kFamily);
  const Matrix features = waves(kJoints * kLstm250.inputs);
  std::vector<Estimate> estimates(kJoints);
  const double seconds = best_seconds(
      [&] {
        for (std::size_t n = 0; n < kTimed; ++n) many.step(features.row(n), estimates);
      },
      2.0);
  const std::size_t weights = weight_count(parameters.layers) + weight_count(parameters.head);
  // A vector holds twice as many floats as doubles.
  const double arithmetic_s =
      static_cast<double>(kJoints * weights) / (2.0 * multiply_adds_per_second());
  return {.value = seconds / kTimed * 1e6,
          .unit = "us",
          .floor = std::max(arithmetic_s, floor_seconds(weights)) * 1e6};
}

namespace {

constexpr std::size_t kAdapted = 250;  // features of the last layer

/// One update with the features of an LSTM of 250 cells; the step of the network is not included.
/// @param pass_bytes read and written in one update, at least. @param multiply_adds computed in it.
Row update_row(AdaptationRule rule, std::size_t pass_bytes, double multiply_adds) {
  const auto parameters = plain_network<Lstm>(kLstm250);
  LastLayerAdapter adapter({.rule = rule, .frozen_after_s = 0.0}, parameters.head.back(), 1.0,
                           1e-3);
  Lstm network(parameters);
  const Matrix inputs = waves(kLstm250.inputs);
  std::vector<detail::AlignedVector<float>> features;
  std::vector<double> frozen;
  for (std::size_t n = 0; n < kTimed; ++n) {
    frozen.push_back(network.step(inputs.row(n)).value);
    const auto seen = network.last_layer_input();
    features.emplace_back(seen.begin(), seen.end());
  }
  std::size_t missed = 0;
  const double seconds = best_seconds(
      [&] {
        for (std::size_t n = 0; n < kTimed; ++n) {
          (void)adapter.step(features[n], frozen[n]);
          const UpdateOutcome outcome = adapter.learn({.value = frozen[n] + 0.1 * inputs(n, 0)});
          if (outcome != UpdateOutcome::updated && outcome != UpdateOutcome::limited) ++missed;
        }
      },
      2.0);
  if (missed > 0) throw std::logic_error("an update was passed over: nothing was measured");
  return {
      .value = seconds / kTimed * 1e6,
      .unit = "us",
      .floor =
          std::max(stream_seconds(pass_bytes), multiply_adds / multiply_adds_per_second()) * 1e6};
}

}  // namespace

Row lstm250_nlms_update() {
  // Correction, square of the features, the update, and its square; three vectors.
  return update_row(AdaptationRule::nlms, 3 * kAdapted * sizeof(double), 4.0 * kAdapted);
}

Row lstm250_rls_update() {
  // Half of P is read and written; each of its numbers is updated, scaled, and used in two rows.
  constexpr std::size_t kNumbers = (kAdapted + 1) * (kAdapted + 2) / 2;
  return update_row(AdaptationRule::rls, 2 * kNumbers * sizeof(double), 4.0 * kNumbers);
}

}  // namespace torsio::bench
