// Training steps: an LSTM of 250 cells on 64 windows of 200 samples, an MLP on 200 000 rows.
#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "fit/network/network_initialisation.hpp"
#include "fit/network/network_trainer.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"

namespace torsio::bench {
namespace {

using Kind = TrainingLayer::Kind;

constexpr std::size_t kCells = 250;
constexpr std::size_t kSteps = 200;
constexpr std::size_t kBatch = 64;
constexpr std::size_t kRows = 200'000;

WindowSet noise(std::size_t steps, std::size_t burn_in, std::size_t inputs, std::size_t windows) {
  Random random(1);
  WindowSet set{.steps = steps, .burn_in = burn_in, .inputs = inputs};
  for (std::size_t n = 0; n < steps * windows; ++n) {
    for (std::size_t j = 0; j < inputs; ++j)
      set.features.push_back(static_cast<float>(random.normal()));
    set.targets.push_back(static_cast<float>(random.normal()));
    set.use.push_back(1);
  }
  for (std::size_t k = 0; k < windows; ++k) set.starts.push_back(k * steps);
  return set;
}

TrainingCheckpoint first_state(const TrainingNetwork& network) {
  Random random(2);
  TrainingCheckpoint state;
  state.weights.assign(network.parameter_count(), 0.0F);
  state.mean = state.square = state.weights;
  for (std::size_t l = 0; l < network.layers().size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    if (layer.kind == Kind::lstm) {
      put_layer(initial_lstm(layer.inputs, layer.units, random), network, l, state.weights.data());
    } else {
      put_layer(initial_dense(layer.inputs, layer.units, layer.activation, random), network, l,
                state.weights.data());
    }
  }
  return state;
}

double lstm_batch_seconds(std::size_t threads) {
  const TrainingNetwork network({{Kind::lstm, 2, kCells}, {Kind::dense, kCells, 1}});
  NetworkTrainer trainer(network, {.threads = threads});
  TrainingCheckpoint state = first_state(network);
  const WindowSet set = noise(kSteps, 20, 2, kBatch);
  std::vector<std::size_t> windows(kBatch);
  std::iota(windows.begin(), windows.end(), std::size_t{0});
  return best_seconds([&] { static_cast<void>(trainer.update(state, set, windows, 1e-3)); }, 3.0);
}

}  // namespace

Row lstm250_train_batch() {
  // Forwards, back to the state, and the gradient: three products of each row with all weights.
  constexpr double kMultiplyAdds = 3.0 * kBatch * kSteps * 4.0 * kCells * (kCells + 3.0);
  return {.value = lstm_batch_seconds(1) * 1e3,
          .unit = "ms",
          .floor = kMultiplyAdds / (2.0 * multiply_adds_per_second()) * 1e3};
}

// The floor is half of what one thread takes.
Row lstm250_train_2threads() {
  const double one = lstm_batch_seconds(1);
  return {.value = lstm_batch_seconds(2) * 1e3, .unit = "ms", .floor = one / 2.0 * 1e3};
}

Row mlp_epoch() {
  const TrainingNetwork network({{Kind::dense, 3, 50, Activation::relu},
                                 {Kind::dense, 50, 20, Activation::relu},
                                 {Kind::dense, 20, 10, Activation::relu},
                                 {Kind::dense, 10, 1}});
  NetworkTrainer trainer(network, {.clip = 0.0, .threads = 1});
  TrainingCheckpoint state = first_state(network);
  const WindowSet set = noise(1, 0, 3, kRows);
  Random random(3);
  std::vector<std::size_t> windows(kRows);
  std::iota(windows.begin(), windows.end(), std::size_t{0});
  const double seconds = best_seconds([&] {
    for (std::size_t k = kRows; k-- > 1;) std::swap(windows[k], windows[random.below(k + 1)]);
    for (std::size_t k = 0; k < kRows; k += kBatch)
      static_cast<void>(trainer.update(
          state, set, std::span(windows).subspan(k, std::min(kBatch, kRows - k)), 1e-3));
  });
  return {.value = seconds * 1e3, .unit = "ms"};
}

}  // namespace torsio::bench
