#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rows.hpp"
#include "torsio/estimate/estimator_batch.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kRows = 4096;

/// The shortest step of 4096 joints, each elsewhere in a sweep inside the ranges of the training, once
/// their filters have settled.
Row batch_row(const std::string& family, std::map<std::string, std::string> settings) {
  constexpr std::size_t kSettling = 400;
  constexpr std::size_t kTicks = 1000;
  const Dataset dataset = sweep_dataset("dfki-50", 1);
  const ModelChoice choice{family, std::move(settings), "", resolve_inputs(dataset, {})};
  const TrainedModel trained = train_model(dataset, choice, 1);
  EstimatorBatch batch(trained.file.settings, AnyModel(trained.file.parameters), kRows);
  const Recording& recording = dataset.records.front().recording;
  std::vector<const Channel*> channels;
  for (const std::string& name : batch.raw_inputs()) channels.push_back(&recording.channel(name));
  std::vector<double> raw(kRows * channels.size());
  std::vector<Estimate> estimates(kRows);
  double best_s = 1e9;
  for (std::size_t tick = 0; tick < kTicks; ++tick) {
    for (std::size_t row = 0; row < kRows; ++row)
      for (std::size_t c = 0; c < channels.size(); ++c)
        raw[row * channels.size() + c] =
            channels[c]->values[(4 * row + tick) % (recording.size() - 1)];
    const auto start = std::chrono::steady_clock::now();
    batch.step(raw, estimates);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    if (tick >= kSettling) best_s = std::min(best_s, spent.count());
  }
  return {.value = 1e3 * best_s, .unit = "ms"};
}

}  // namespace

Row batch_4096_grey_box() { return batch_row("grey_box", {}); }
Row batch_4096_lstm32() { return batch_row("lstm", {{"layers", "32"}, {"epochs", "1"}}); }

}  // namespace torsio::bench
