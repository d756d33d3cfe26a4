// Backpropagation against central differences of the loss.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fit/network/network_trainer.hpp"
#include "network_example.hpp"
#include "numerics/float_gemm.hpp"
#include "support/each_instruction_set.hpp"

namespace torsio {
namespace {

using Kind = TrainingLayer::Kind;

struct Case {
  std::string name;
  std::vector<TrainingLayer> layers;
  std::size_t steps = 1;
  std::size_t burn_in = 0;
  bool last_only = false;
};

void PrintTo(const Case& each, std::ostream* out) { *out << each.name; }

/// Is this number of the flat list one that the network has, and not padding?
std::vector<bool> own_parameters(const TrainingNetwork& network) {
  std::vector<bool> own(network.parameter_count(), false);
  for (std::size_t l = 0; l < network.layers().size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    const std::size_t blocks = layer.kind == Kind::gru ? 3 : 1;
    for (std::size_t b = 0; b < blocks; ++b) {
      const ParameterBlock& block = network.block(l, b);
      for (std::size_t k = 0; k < block.rows * block.columns; ++k)
        own[block.offset + k] = k % block.columns % layer.width() < layer.units;
    }
  }
  return own;
}

class Gradient : public testing::TestWithParam<Case> {};

TEST_P(Gradient, IsThatOfFiniteDifferences) {
  const Case& each = GetParam();
  const TrainingNetwork network(each.layers);
  WindowSet set = test::random_windows(each.steps, each.burn_in, network.inputs(), 21, 3);
  set.last_only = each.last_only;
  std::erase_if(set.starts, [&](std::size_t start) { return set.counted(start) == 0; });
  std::vector<float> weights = test::initial_weights(network, 5);
  Random random(11);  // biases too, away from zero
  const std::vector<bool> own = own_parameters(network);
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (own[k]) weights[k] += static_cast<float>(0.1 * random.normal());

  NetworkTrainer trainer(network, {.threads = 1});
  const double loss = trainer.loss_and_gradient(weights, set, test::every_window(set));
  EXPECT_NEAR(loss, trainer.loss(weights, set), 1e-6 * loss);
  const std::vector<float> gradient(trainer.gradient().begin(), trainer.gradient().end());

  constexpr float kStep = 4e-3F;
  double largest = 0.0;
  for (const float slope : gradient)
    largest = std::max(largest, std::abs(static_cast<double>(slope)));
  EXPECT_GT(largest, 1e-3);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (!own[k]) {
      EXPECT_EQ(gradient[k], 0.0F) << "padding " << k;
      continue;
    }
    const float before = weights[k];
    weights[k] = before + kStep;
    const double above = trainer.loss(weights, set);
    const double width_above = static_cast<double>(weights[k]) - static_cast<double>(before);
    weights[k] = before - kStep;
    const double below = trainer.loss(weights, set);
    const double width =
        width_above + static_cast<double>(before) - static_cast<double>(weights[k]);
    weights[k] = before;
    EXPECT_NEAR(static_cast<double>(gradient[k]), (above - below) / width, 2e-3 * largest)
        << "parameter " << k;
  }
}

std::vector<TrainingLayer> dense(Activation activation) {
  return {{Kind::dense, 3, 5, activation}, {Kind::dense, 5, 4, activation}, {Kind::dense, 4, 1}};
}

INSTANTIATE_TEST_SUITE_P(
    OfEvery, Gradient,
    testing::Values(
        Case{"linear", dense(Activation::linear)}, Case{"relu", dense(Activation::relu)},
        Case{"tanh", dense(Activation::tanh)}, Case{"softsign", dense(Activation::softsign)},
        Case{"elu", dense(Activation::elu)},
        Case{"lstm", {{Kind::lstm, 2, 3}, {Kind::dense, 3, 1}}, 7, 2},
        Case{"gru", {{Kind::gru, 2, 3}, {Kind::dense, 3, 1}}, 7, 2},
        Case{"lstm_to_one", {{Kind::lstm, 2, 3}, {Kind::dense, 3, 1}}, 6, 0, true},
        Case{"lstm_of_seventeen", {{Kind::lstm, 1, 17}, {Kind::dense, 17, 1}}, 3},
        Case{"stacked_lstm",
             {{Kind::lstm, 2, 4},
              {Kind::lstm, 4, 3},
              {Kind::dense, 3, 5, Activation::tanh},
              {Kind::dense, 5, 1}},
             5,
             1},
        Case{"stacked_gru", {{Kind::gru, 2, 4}, {Kind::gru, 4, 3}, {Kind::dense, 3, 1}}, 5, 1},
        Case{"lstm_on_gru", {{Kind::gru, 2, 4}, {Kind::lstm, 4, 3}, {Kind::dense, 3, 1}}, 4, 0}),
    [](const auto& each) { return each.param.name; });

std::vector<float> noise(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.normal());
  return values;
}

TEST(FloatGemm, MultipliesAsTheTextbookDoesWithEveryInstructionSet) {
  constexpr std::size_t kInner = 300;
  constexpr std::size_t kColumns = 37;
  constexpr std::size_t kStride = float_gemm::in_panels(kColumns);
  for (const std::size_t rows : {1U, 5U, 16U, 23U}) {
    const std::vector<float> a = noise(rows * kInner, 1);
    const std::vector<float> b = noise(kInner * kColumns, 2);
    std::vector<float> b_transposed(b.size());
    std::vector<float> a_transposed(a.size());
    for (std::size_t k = 0; k < kInner; ++k) {
      for (std::size_t j = 0; j < kColumns; ++j) b_transposed[j * kInner + k] = b[k * kColumns + j];
      for (std::size_t i = 0; i < rows; ++i) a_transposed[k * rows + i] = a[i * kInner + k];
    }
    test::on_each_instruction_set([&](const char* set) {
      float_gemm::PackedMatrix packed;
      float_gemm::PackedMatrix from_transposed;
      packed.pack(b.data(), kColumns, kInner, kColumns);
      from_transposed.pack_transposed(b_transposed.data(), kInner, kInner, kColumns);
      std::vector<float> plain(rows * kStride, 7.0F);
      std::vector<float> added(rows * kStride, 1.0F);
      std::vector<float> of_transposed(rows * kStride, 1.0F);
      float_gemm::Scratch scratch;
      float_gemm::multiply(a.data(), kInner, rows, packed, plain.data(), kStride, false);
      float_gemm::multiply(a.data(), kInner, rows, from_transposed, added.data(), kStride, true);
      float_gemm::add_product_of_transposed(a_transposed.data(), rows, rows, b.data(), kColumns,
                                            kColumns, kInner, of_transposed.data(), kStride,
                                            scratch);
      for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t j = 0; j < kColumns; ++j) {
          double sum = 0.0;
          for (std::size_t k = 0; k < kInner; ++k)
            sum +=
                static_cast<double>(a[i * kInner + k]) * static_cast<double>(b[k * kColumns + j]);
          EXPECT_NEAR(static_cast<double>(plain[i * kStride + j]), sum, 2e-4) << set;
          EXPECT_NEAR(static_cast<double>(added[i * kStride + j]), sum + 1.0, 2e-4) << set;
          EXPECT_NEAR(static_cast<double>(of_transposed[i * kStride + j]), sum + 1.0, 2e-4) << set;
        }
    });
  }
}

}  // namespace
}  // namespace torsio
