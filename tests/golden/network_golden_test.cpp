// Networks and their training against PyTorch (make_network_oracles.py).
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "fit/network/network_trainer.hpp"
#include "golden_file.hpp"

namespace torsio {
namespace {

using test::golden;
using test::Json;
using Kind = TrainingLayer::Kind;

TrainingNetwork network_of(const Json& shape) {
  std::vector<TrainingLayer> layers;
  auto inputs = shape["inputs"].get<std::size_t>();
  const Kind kind = shape["kind"] == "gru" ? Kind::gru : Kind::lstm;
  for (const Json& units : shape["units"]) {
    layers.push_back({kind, inputs, units});
    inputs = units;
  }
  for (const Json& units : shape["hidden"]) {
    layers.push_back(
        {Kind::dense, inputs, units, activation_of(shape["activation"].get<std::string>())});
    inputs = units;
  }
  layers.push_back({Kind::dense, inputs, 1});
  return TrainingNetwork(std::move(layers));
}

std::vector<float> floats(const Json& array) { return array.get<std::vector<float>>(); }

FloatMatrix float_matrix(const Json& array, std::size_t columns) {
  FloatMatrix result(array.size() / columns, columns);
  result.values = floats(array);
  return result;
}

/// PyTorch's values or gradients ("value", "gradient") in the order of the flat list.
std::vector<float> flat(const TrainingNetwork& network, const Json& parameters, const char* what) {
  std::vector<float> all(network.parameter_count(), 0.0F);
  std::size_t memory = 0;
  for (std::size_t l = 0; l < network.layers().size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    const auto part = [&](const std::string& list, std::size_t index, const char* name) {
      return parameters[list + "." + std::to_string(index) + "." + name][what];
    };
    if (layer.kind == Kind::dense) {
      put_layer(
          DenseLayer{.weights = float_matrix(part("dense", l - memory, "weight"), layer.inputs),
                     .bias = floats(part("dense", l - memory, "bias"))},
          network, l, all.data());
      continue;
    }
    const FloatMatrix of_inputs = float_matrix(part("memory", l, "weight_ih_l0"), layer.inputs);
    const FloatMatrix of_state = float_matrix(part("memory", l, "weight_hh_l0"), layer.units);
    const std::vector<float> bias = floats(part("memory", l, "bias_ih_l0"));
    if (layer.kind == Kind::lstm) {
      put_layer(LstmLayer{of_inputs, of_state, bias}, network, l, all.data());
    } else {
      put_layer(GruLayer{of_inputs, of_state, bias, floats(part("memory", l, "bias_hh_l0"))},
                network, l, all.data());
    }
    ++memory;
  }
  return all;
}

/// The golden batch, [steps x rows], as consecutive windows.
WindowSet windows_of(const Json& each, std::size_t inputs) {
  const auto steps = each["steps"].get<std::size_t>();
  const auto rows = each["rows"].get<std::size_t>();
  WindowSet set{.steps = steps, .burn_in = each["burn_in"], .inputs = inputs};
  for (std::size_t row = 0; row < rows; ++row) {
    set.starts.push_back(row * steps);
    for (std::size_t t = 0; t < steps; ++t) {
      const std::size_t from = t * rows + row;
      for (std::size_t j = 0; j < inputs; ++j) set.features.push_back(each["x"][from * inputs + j]);
      const bool is_used = each["mask"][from] == 1;
      set.use.push_back(is_used ? 1 : 0);
      set.targets.push_back(is_used ? each["y"][from].get<float>() : 0.0F);
    }
  }
  return set;
}

std::string label(const Json& each) { return each["shape"].dump(); }

TEST(NetworkGolden, OutputsAreThoseOfPyTorch) {
  for (const Json& each : golden("networks.json")) {
    SCOPED_TRACE(label(each));
    const TrainingNetwork network = network_of(each["shape"]);
    const std::vector<float> weights = flat(network, each["parameters"], "value");
    const WindowSet set = windows_of(each, network.inputs());
    SequenceBatch batch;
    std::vector<std::size_t> windows(set.starts.size());
    std::iota(windows.begin(), windows.end(), std::size_t{0});
    set.fill(windows, batch);
    PackedNetwork packed;
    packed.pack(network, weights.data());
    NetworkPass pass;
    pass.forward(network, packed, batch);
    for (std::size_t t = 0; t < batch.steps; ++t)
      for (std::size_t row = 0; row < batch.rows; ++row)
        EXPECT_NEAR(pass.output(t, row), each["output"][t * batch.rows + row].get<float>(), 3e-6F);
  }
}

TEST(NetworkGolden, TheGradientIsThatOfPyTorch) {
  for (const Json& each : golden("networks.json")) {
    SCOPED_TRACE(label(each));
    const TrainingNetwork network = network_of(each["shape"]);
    const WindowSet set = windows_of(each, network.inputs());
    NetworkTrainer trainer(network, {.threads = 1});
    std::vector<std::size_t> windows(set.starts.size());
    std::iota(windows.begin(), windows.end(), std::size_t{0});
    (void)trainer.loss_and_gradient(flat(network, each["parameters"], "value"), set, windows);
    const std::vector<float> expected = flat(network, each["parameters"], "gradient");
    for (std::size_t k = 0; k < expected.size(); ++k)
      EXPECT_NEAR(trainer.gradient()[k], expected[k], 3e-6F) << "parameter " << k;
  }
}

TEST(NetworkGolden, TheLossOverFiftyUpdatesIsThatOfPyTorch) {
  for (const Json& each : golden("networks.json")) {
    for (const auto& [optimiser, losses] : each["losses"].items()) {
      SCOPED_TRACE(label(each) + " " + optimiser);
      const TrainingNetwork network = network_of(each["shape"]);
      const WindowSet set = windows_of(each, network.inputs());
      NetworkTraining settings{.clip = each["clip"], .threads = 1};
      if (optimiser == "adamw") settings.optimiser = Optimiser::adamw;
      if (optimiser != "adam") settings.weight_decay = each["decay"];
      NetworkTrainer trainer(network, settings);
      TrainingCheckpoint state;
      state.weights = flat(network, each["parameters"], "value");
      state.mean.assign(state.weights.size(), 0.0F);
      state.square = state.mean;
      std::vector<std::size_t> windows(set.starts.size());
      std::iota(windows.begin(), windows.end(), std::size_t{0});
      for (std::size_t k = 0; k < losses.size(); ++k)
        ASSERT_NEAR(trainer.update(state, set, windows, each["rate"]), losses[k].get<double>(),
                    1e-4 * losses[k].get<double>())
            << "update " << k;
      EXPECT_LT(losses.back(), 0.97 * losses.front().get<double>());  // it did learn
    }
  }
}

}  // namespace
}  // namespace torsio
