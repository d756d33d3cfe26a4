// One step of libtorch on the network and the inputs of torsio_bench, one thread, no gradients.
//
// Usage: peer_network ROW FOLDER; prints microseconds. What libtorch offers for a step (the layer
// run on a sequence of one, or the cell) is tried, and the fastest counts.

#include <torch/torch.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace {

constexpr std::int64_t kInputs = 2;
constexpr std::int64_t kJoints = 12;
constexpr std::size_t kTimed = 20;

template <class Number>
std::vector<Number> read(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  const std::vector<char> bytes((std::istreambuf_iterator<char>(in)), {});
  std::vector<Number> values(bytes.size() / sizeof(Number));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(values.data()));
  return values;
}

class Weights {
 public:
  explicit Weights(const std::string& file) : values_(read<float>(file)) {}
  void fill(torch::Tensor tensor) {
    tensor.copy_(torch::from_blob(values_.data() + at_, tensor.sizes()));
    at_ += static_cast<std::size_t>(tensor.numel());
  }
  void fill(torch::nn::Linear& layer) {
    fill(layer->weight);
    fill(layer->bias);
  }

 private:
  std::vector<float> values_;
  std::size_t at_ = 0;
};

/// Input [batch, inputs] to output [batch, 1]; keeps its state.
using Step = std::function<torch::Tensor(const torch::Tensor&)>;

std::vector<Step> lstm_steps(Weights weights, std::int64_t units, std::int64_t batch) {
  torch::nn::LSTM layer(kInputs, units);
  torch::nn::LSTMCell cell(kInputs, units);
  torch::nn::Linear head(units, 1);
  weights.fill(cell->weight_ih);
  weights.fill(cell->weight_hh);
  weights.fill(cell->bias_ih);
  cell->bias_hh.zero_();
  weights.fill(head);
  const auto named = layer->named_parameters();
  named["weight_ih_l0"].copy_(cell->weight_ih);
  named["weight_hh_l0"].copy_(cell->weight_hh);
  named["bias_ih_l0"].copy_(cell->bias_ih);
  named["bias_hh_l0"].zero_();
  auto zero = [&](auto... sizes) { return torch::zeros({sizes..., batch, units}); };
  Step by_layer = [=, state = std::make_tuple(zero(1), zero(1))](const torch::Tensor& x) mutable {
    auto [output, next] = layer->forward(x.unsqueeze(0), state);
    state = next;
    return head->forward(output[0]);
  };
  auto empty = torch::zeros({batch, units});
  Step by_cell = [=, state = std::make_tuple(empty, empty)](const torch::Tensor& x) mutable {
    state = cell->forward(x, state);
    return head->forward(std::get<0>(state));
  };
  return {by_layer, by_cell};
}

std::vector<Step> gru_steps(Weights weights, std::int64_t units) {
  torch::nn::GRU layer(kInputs, units);
  torch::nn::GRUCell cell(kInputs, units);
  torch::nn::Linear head(units, 1);
  weights.fill(cell->weight_ih);
  weights.fill(cell->weight_hh);
  weights.fill(cell->bias_ih);
  weights.fill(cell->bias_hh);
  weights.fill(head);
  const auto named = layer->named_parameters();
  named["weight_ih_l0"].copy_(cell->weight_ih);
  named["weight_hh_l0"].copy_(cell->weight_hh);
  named["bias_ih_l0"].copy_(cell->bias_ih);
  named["bias_hh_l0"].copy_(cell->bias_hh);
  Step by_layer = [=, h = torch::zeros({1, 1, units})](const torch::Tensor& x) mutable {
    auto [output, next] = layer->forward(x.unsqueeze(0), h);
    h = next;
    return head->forward(output[0]);
  };
  Step by_cell = [=, h = torch::zeros({1, units})](const torch::Tensor& x) mutable {
    h = cell->forward(x, h);
    return head->forward(h);
  };
  return {by_layer, by_cell};
}

std::vector<Step> mlp_steps(Weights weights) {
  std::vector<torch::nn::Linear> layers{torch::nn::Linear(3, 50), torch::nn::Linear(50, 20),
                                        torch::nn::Linear(20, 10), torch::nn::Linear(10, 1)};
  for (torch::nn::Linear& layer : layers) weights.fill(layer);
  return {[layers](const torch::Tensor& input) mutable {
    torch::Tensor x = input;
    for (std::size_t i = 0; i + 1 < layers.size(); ++i) x = torch::relu(layers[i]->forward(x));
    return layers.back()->forward(x);
  }};
}

std::vector<Step> steps_of(const std::string& row, const std::string& folder) {
  const Weights weights(folder + "/network.f32");
  if (row == "lstm250_step") return lstm_steps(weights, 250, 1);
  if (row == "lstm250_x12_step") return lstm_steps(weights, 250, kJoints);
  if (row == "lstm32_step") return lstm_steps(weights, 32, 1);
  if (row == "gru64_step") return gru_steps(weights, 64);
  if (row == "mlp_step") return mlp_steps(weights);
  throw std::runtime_error("no row is called " + row);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: peer_network ROW FOLDER");
  const std::string row = argv[1];
  const std::string folder = argv[2];
  at::set_num_threads(1);
  const c10::InferenceMode guard;
  const auto expected = read<double>(folder + "/network_outputs.f64");
  const auto values = read<double>(folder + "/network_inputs.f64");
  const auto count = static_cast<std::int64_t>(expected.size());
  const std::int64_t inputs = static_cast<std::int64_t>(values.size()) / count;
  const std::int64_t batch = row == "lstm250_x12_step" ? kJoints : 1;
  std::vector<torch::Tensor> rows;
  for (std::int64_t n = 0; n < count; ++n) {
    torch::Tensor x = torch::empty({1, inputs});
    for (std::int64_t j = 0; j < inputs; ++j)
      x[0][j] = static_cast<float>(values[static_cast<std::size_t>(n * inputs + j)]);
    rows.push_back(x.repeat({batch, 1}));
  }
  double best = std::numeric_limits<double>::infinity();
  for (Step& step : steps_of(row, folder)) {
    for (std::size_t n = 0; n < rows.size(); ++n) {
      const double output = step(rows[n])[batch - 1][0].item<double>();
      if (!(std::abs(output - expected[n]) < 1e-4))
        throw std::runtime_error("libtorch has another output at step " + std::to_string(n));
    }
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    while (std::chrono::steady_clock::now() < limit) {
      const auto begin = std::chrono::steady_clock::now();
      for (std::size_t n = 0; n < kTimed; ++n) step(rows[n]);
      const std::chrono::duration<double> span = std::chrono::steady_clock::now() - begin;
      best = std::min(best, span.count() / kTimed);
    }
  }
  std::printf("%.6g\n", best * 1e6);
} catch (const std::exception& error) {
  std::fprintf(stderr, "peer_network: %s\n", error.what());
  return 1;
}
