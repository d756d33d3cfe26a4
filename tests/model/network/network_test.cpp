// Mlp, Lstm and Gru against their equations, and what their constructors refuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "support/each_instruction_set.hpp"
#include "support/error_message.hpp"
#include "support/examples/example.hpp"
#include "support/network_reference.hpp"
#include "support/random_network.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::example_features;
using test::NetworkReference;
using test::NetworkShape;
using test::random_network;
using testing::HasSubstr;

constexpr std::size_t kSteps = 60;

/// Error of the network's outputs over a run, relative to the spread of the target.
template <class Network>
double largest_error(const NetworkShape& shape, std::uint64_t seed) {
  const auto parameters = random_network<Network>(shape, seed);
  Network network(parameters);
  NetworkReference<Network> reference(parameters);
  const Matrix features = example_features(kSteps, shape.inputs);
  double largest = 0.0;
  for (std::size_t n = 0; n < kSteps; ++n) {
    const double expected = reference.step(features.row(n));
    const double error = network.step(features.row(n)).value - expected;
    largest = std::max(largest, std::abs(error) / parameters.scaling.target_scale);
  }
  return largest;
}

std::vector<NetworkShape> recurrent_shapes() {
  std::vector<NetworkShape> shapes;
  for (const std::size_t units : {1U, 3U, 7U, 8U, 16U, 17U, 33U, 64U})
    for (const std::size_t inputs : {1U, 2U, 5U})
      shapes.push_back({.inputs = inputs, .units = {units}});
  shapes.push_back({.units = {250}});
  shapes.push_back({.inputs = 3, .units = {7, 17, 33}});
  shapes.push_back({.units = {17}, .hidden = {7}});
  shapes.push_back({.units = {33, 1}, .hidden = {16, 3, 17}, .activation = Activation::elu});
  shapes.push_back({.units = {8, 33}, .biases_apart = true});
  return shapes;
}

std::vector<NetworkShape> dense_shapes() {
  std::vector<NetworkShape> shapes;
  for (const Activation activation : {Activation::linear, Activation::relu, Activation::tanh,
                                      Activation::softsign, Activation::elu})
    for (const std::size_t units : {1U, 3U, 7U, 16U, 17U, 33U, 250U})
      shapes.push_back({.inputs = 1 + units % 5, .hidden = {units}, .activation = activation});
  shapes.push_back({.inputs = 3, .hidden = {}});
  shapes.push_back({.inputs = 3, .hidden = {50, 20, 10}, .activation = Activation::relu});
  shapes.push_back({.inputs = 17, .hidden = {1, 33, 1, 250, 7}});
  return shapes;
}

template <class Network>
void expect_the_equations(const std::vector<NetworkShape>& shapes) {
  for (std::size_t k = 0; k < shapes.size(); ++k)
    EXPECT_LT(largest_error<Network>(shapes[k], k), 5e-6) << Network::kFamily << ", shape " << k;
}

TEST(Networks, FollowTheirEquationsOnEveryInstructionSet) {
  int sets = 0;
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    ++sets;
    expect_the_equations<Mlp>(dense_shapes());
    expect_the_equations<Lstm>(recurrent_shapes());
    expect_the_equations<Gru>(recurrent_shapes());
  });
  EXPECT_GE(sets, test::kFewestInstructionSets);
}

/// A network whose answer is its activation.
Mlp single(Activation activation) {
  Mlp::Parameters parameters;
  parameters.scaling.inputs = {.centre = {0.0}, .scale = {1.0}};
  DenseLayer layer{.weights = FloatMatrix(1, 1, 1.0F),
                   .bias = {0.0F},
                   .activation = static_cast<std::size_t>(activation)};
  parameters.layers = {layer, layer};
  parameters.layers[1].activation = 0;
  return Mlp(parameters);
}

TEST(Networks, ActivationsAreAsExactAsStated) {
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    for (const Activation activation : {Activation::linear, Activation::relu, Activation::tanh,
                                        Activation::softsign, Activation::elu}) {
      Mlp network = single(activation);
      for (double x = 1e-6; x < 1e6; x *= 1.01)
        for (const double signed_x : {x, -x}) {
          const auto rounded = static_cast<double>(static_cast<float>(signed_x));
          const double expected = test::activated(activation, rounded);
          ASSERT_NEAR(network.step({&signed_x, 1}).value, expected, 4e-7 * std::abs(expected))
              << torsio::name(activation) << " of " << signed_x;
        }
    }
  });
}

TEST(Networks, LetWhatIsNotFiniteThrough) {
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    for (const Activation activation : {Activation::linear, Activation::relu, Activation::tanh,
                                        Activation::softsign, Activation::elu}) {
      const double nan = kNotMeasured;
      EXPECT_TRUE(std::isnan(single(activation).step({&nan, 1}).value)) << torsio::name(activation);
    }
    const std::vector<double> unmeasured(2, kNotMeasured);
    const std::vector<double> near(2, 0.1);
    Lstm lstm(random_network<Lstm>({.units = {17}}, 1));
    const double first = lstm.step(near).value;
    EXPECT_TRUE(std::isnan(lstm.step(unmeasured).value));
    EXPECT_TRUE(std::isnan(lstm.step(near).value));
    lstm.reset();
    EXPECT_EQ(lstm.step(near).value, first);
  });
}

template <class Network>
class Recurrent : public testing::Test {};
using RecurrentNetworks = testing::Types<Lstm, Gru>;
TYPED_TEST_SUITE(Recurrent, RecurrentNetworks);

TYPED_TEST(Recurrent, WarmsUpForItsStatedNumberOfSamples) {
  TypeParam network(random_network<TypeParam>({.warm_up_samples = 3}, 2));
  const std::vector<double> features{0.1, 0.2};
  for (int run = 0; run < 2; ++run) {
    for (int n = 0; n < 3; ++n) EXPECT_EQ(network.step(features).fault, Fault::warming_up) << n;
    EXPECT_EQ(network.step(features).fault, Fault::none);
    network.reset();
  }
}

TYPED_TEST(Recurrent, GoesOnFromAStateThatItGave) {
  TypeParam network(random_network<TypeParam>({.units = {7, 17}, .warm_up_samples = 1000}, 3));
  const Matrix features = example_features(kSteps, 2);
  for (std::size_t n = 0; n < kSteps / 2; ++n) (void)network.step(features.row(n));
  std::vector<float> state(network.state_size());
  EXPECT_EQ(state.size(), (7U + 17U) * (std::same_as<TypeParam, Lstm> ? 2U : 1U));
  network.get_state(state);
  TypeParam other(network.parameters());
  (void)other.step(features.row(5));
  other.reset(state);
  for (std::size_t n = kSteps / 2; n < kSteps; ++n) {
    const Estimate estimate = other.step(features.row(n));
    EXPECT_EQ(estimate.value, network.step(features.row(n)).value);
    EXPECT_EQ(estimate.fault, Fault::none) << "a given state counts as warmed up";
  }
}

TYPED_TEST(Recurrent, ReturnsTheInputsOfItsLastLayer) {
  for (const std::vector<std::size_t>& hidden : {std::vector<std::size_t>{}, {5}}) {
    TypeParam network(random_network<TypeParam>({.units = {7}, .hidden = hidden}, 4));
    const TypeParam copy_before = network;
    const double value = network.step(std::vector{0.1, -0.2}).value;
    const std::span<const float> seen = network.last_layer_input();
    const DenseLayer& last = network.parameters().head.back();
    ASSERT_EQ(seen.size(), last.weights.columns);
    auto sum = static_cast<double>(last.bias[0]);
    for (std::size_t j = 0; j < seen.size(); ++j)
      sum += static_cast<double>(last.weights(0, j)) * static_cast<double>(seen[j]);
    EXPECT_NEAR(0.5 + 40.0 * sum, value, 1e-4);
    EXPECT_NE(copy_before.last_layer_input().data(), seen.data());
  }
}

// Whatever the number of joints and whichever of them is reset: equal to single networks to the bit.
TYPED_TEST(Recurrent, ManyJointsEqualOneNetworkEach) {
  for (const std::size_t joints : {1U, 2U, 5U, 6U, 7U, 12U, 13U}) {
    SCOPED_TRACE(joints);
    const auto parameters = random_network<TypeParam>(
        {.units = {33, 17}, .hidden = {5}, .warm_up_samples = 2, .biases_apart = joints % 2 == 1},
        joints);
    RecurrentNetwork<typename TypeParam::Layer> many(parameters, joints, TypeParam::kFamily);
    std::vector<TypeParam> alone(joints, TypeParam(parameters));
    std::vector<double> features(joints * 2);
    std::vector<Estimate> estimate(joints);
    const Matrix wave = example_features(kSteps + joints, 2);
    for (std::size_t n = 0; n < kSteps; ++n) {
      for (std::size_t joint = 0; joint < joints; ++joint)
        std::ranges::copy(wave.row(n + joint),
                          features.begin() + static_cast<std::ptrdiff_t>(2 * joint));
      if (n == kSteps / 2) {
        many.reset(joints / 2);
        alone[joints / 2].reset();
      }
      many.step(features, estimate);
      for (std::size_t joint = 0; joint < joints; ++joint) {
        const Estimate expected = alone[joint].step({features.data() + 2 * joint, 2});
        ASSERT_EQ(estimate[joint].value, expected.value) << "joint " << joint << ", step " << n;
        ASSERT_EQ(estimate[joint].fault, expected.fault);
      }
    }
  }
}

TEST(Networks, CountWhatTrainingMayChange) {
  EXPECT_EQ(Lstm(random_network<Lstm>({.units = {250}}, 1)).parameter_count(), 253000U + 251U);
  EXPECT_EQ(Gru(random_network<Gru>({.units = {64}}, 1)).parameter_count(),
            192U * (2U + 64U + 2U) + 65U);
  EXPECT_EQ(Mlp(random_network<Mlp>({.inputs = 3, .hidden = {50, 20, 10}}, 1)).parameter_count(),
            1441U);
}

template <class Network>
std::string complaint(const std::function<void(typename Network::Parameters&)>& spoil) {
  typename Network::Parameters parameters =
      random_network<Network>({.units = {6, 5}, .hidden = {4}}, 1);
  spoil(parameters);
  return error_message([&] { Network{parameters}; });
}

TEST(Networks, NameTheLayerThatIsWrong) {
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers[1].recurrent_weights.columns = 4; }),
              HasSubstr("lstm: layers.1.recurrent_weights: expected 20 x 5, found 20 x 4"));
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers[1].recurrent_weights.values.pop_back(); }),
              HasSubstr("lstm: layers.1.recurrent_weights: expected 100 numbers, found 99"));
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers[0].recurrent_weights.rows = 23; }),
              HasSubstr("layers.0.recurrent_weights: expected 4 rows for each of 1 to 65536 units, "
                        "found 23 rows"));
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers[0].input_weights = FloatMatrix(24, 3); }),
              HasSubstr("lstm: layers.0.input_weights: expected 24 x 2, found 24 x 3"));
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers[1].bias.pop_back(); }),
              HasSubstr("lstm: layers.1.bias: expected 20 numbers, found 19"));
  EXPECT_THAT(complaint<Gru>([](auto& p) {
                p.layers[1].recurrent_bias[3] = std::numeric_limits<float>::quiet_NaN();
              }),
              HasSubstr("gru: layers.1.recurrent_bias: expected finite numbers, found nan at "
                        "index 3"));
  EXPECT_THAT(complaint<Gru>([](auto& p) { p.layers[0].input_bias.clear(); }),
              HasSubstr("gru: layers.0.input_bias: expected 18 numbers, found 0"));
  EXPECT_THAT(complaint<Gru>([](auto& p) { p.head[0].weights = FloatMatrix(4, 6); }),
              HasSubstr("gru: head.0.weights: expected 4 x 5, found 4 x 6"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.layers[0].activation = 9; }),
              HasSubstr("mlp: layers.0.activation: expected a number below 5, found 9"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.layers.back().activation = 2; }),
              HasSubstr("mlp: layers.1.activation: expected a linear last layer, found tanh"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.layers.pop_back(); }),
              HasSubstr("mlp: layers.0.weights: expected one output of the last layer, found 4"));
}

TEST(Networks, RefuseWhatIsNoNetwork) {
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.layers.clear(); }),
              HasSubstr("lstm: layers: expected 1 to 64 layers, found 0"));
  EXPECT_THAT(complaint<Gru>([](auto& p) { p.head.clear(); }),
              HasSubstr("gru: head: expected 1 to 64 layers, found 0"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.layers.resize(65); }),
              HasSubstr("mlp: layers: expected 1 to 64 layers, found 65"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.layers[0].weights = FloatMatrix(65537, 2); }),
              HasSubstr("mlp: layers.0.weights: expected 1 to 65536 rows, found 65537 rows"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.scaling.inputs = {}; }),
              HasSubstr("mlp: scaling.inputs.centre: expected 1 to 65536 inputs, found 0"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.scaling.inputs.scale[1] = 0.0; }),
              HasSubstr("mlp: scaling.inputs.scale[1]: expected a positive, finite number"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.scaling.inputs.centre[0] = kNotMeasured; }),
              HasSubstr("mlp: scaling.inputs.centre: expected finite numbers, found nan"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.scaling.target_scale = -1.0; }),
              HasSubstr("mlp: scaling.target_scale: expected a positive, finite number, found -1"));
  EXPECT_THAT(complaint<Mlp>([](auto& p) { p.scaling.target_centre = kNotMeasured; }),
              HasSubstr("mlp: scaling.target_centre: expected finite numbers, found nan"));
  EXPECT_THAT(complaint<Lstm>([](auto& p) { p.sample_period_s = 0.0; }),
              HasSubstr("lstm: sample_period_s: expected a positive, finite number, found 0"));
}

TEST(Activations, HaveNames) {
  EXPECT_EQ(activation_of("softsign"), Activation::softsign);
  EXPECT_THAT(error_message([] { (void)activation_of("swish"); }),
              HasSubstr("no activation is called \"swish\"; expected one of linear, relu, tanh, "
                        "softsign, elu"));
}

}  // namespace
}  // namespace torsio
