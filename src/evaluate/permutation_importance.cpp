#include "evaluate/permutation_importance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {
namespace {

constexpr std::size_t kFewestBlocks = 20;

struct Block {
  std::size_t sequence = 0;
  std::size_t begin = 0;
};

std::size_t block_length(const TrainingData& data, std::size_t shortest) {
  std::size_t total = 0;
  std::size_t longest = 0;
  for (const Sequence& sequence : data.sequences) {
    total += sequence.target.size();
    longest = std::max(longest, sequence.target.size());
  }
  const auto second = static_cast<std::size_t>(data.sample_rate_Hz);
  return std::max<std::size_t>(
      1, std::min({std::max(shortest, second), total / kFewestBlocks, longest / 2}));
}

/// The full blocks of every sequence, one after another; the remainder is not shuffled and not
/// scored.
std::vector<Block> blocks_of(const TrainingData& data, std::size_t length) {
  std::vector<Block> blocks;
  for (std::size_t k = 0; k < data.sequences.size(); ++k)
    for (std::size_t begin = 0; begin + length <= data.sequences[k].target.size(); begin += length)
      blocks.push_back({.sequence = k, .begin = begin});
  return blocks;
}

struct SquareSum {
  double sum = 0.0;
  std::size_t samples = 0;

  void add(double error) {
    sum += error * error;
    ++samples;
  }
  [[nodiscard]] double rms() const { return std::sqrt(sum / static_cast<double>(samples)); }
};

/// One input's blocks in another order.
struct Shuffle {
  std::size_t input = 0;
  std::vector<Block> source;  ///< source of each block
};

Shuffle shuffled(std::size_t input, std::vector<Block> blocks, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = blocks.size(); i > 1; --i) std::swap(blocks[i - 1], blocks[random.below(i)]);
  return {.input = input, .source = std::move(blocks)};
}

bool is_scored(const Sequence& sequence, const std::vector<Estimate>& by_sequence, std::size_t n) {
  return sequence.use[n] != 0 && by_sequence[n].fault == Fault::none;
}

/// Runs the model through all blocks in their order, with one input from other blocks.
double shuffled_rmse(AnyModel model, const TrainingData& data,
                     const std::vector<std::vector<Estimate>>& by_sequence,
                     const std::vector<Block>& blocks, const Shuffle& shuffle, std::size_t length,
                     SharedProgress& progress) {
  const DenormalsOff denormals_off;
  SquareSum errors;
  std::vector<double> row(data.input_count());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    const Sequence& sequence = data.sequences[block.sequence];
    const Matrix& source = data.sequences[shuffle.source[b].sequence].features;
    if (block.begin == 0) model.reset();
    for (std::size_t n = 0; n < length; ++n) {
      std::ranges::copy(sequence.features.row(block.begin + n), row.begin());
      row[shuffle.input] = source(shuffle.source[b].begin + n, shuffle.input);
      if (!std::ranges::all_of(row, [](double value) { return std::isfinite(value); })) continue;
      const Estimate estimate = model.step(row);
      if (is_scored(sequence, by_sequence[block.sequence], block.begin + n))
        errors.add(estimate.value - sequence.target[block.begin + n]);
    }
    progress.tick();
  }
  return errors.rms();
}

}  // namespace

PermutationImportance permutation_importance(const AnyModel& model, const TrainingData& data,
                                             const std::vector<std::vector<Estimate>>& by_sequence,
                                             std::size_t shortest_block, std::size_t repeats,
                                             std::uint64_t seed, std::size_t threads,
                                             const Progress& progress) {
  PermutationImportance importance;
  const std::size_t length = block_length(data, shortest_block);
  const std::vector<Block> blocks = blocks_of(data, length);
  SquareSum baseline;
  for (const Block& block : blocks) {
    const Sequence& sequence = data.sequences[block.sequence];
    const std::vector<Estimate>& estimates = by_sequence[block.sequence];
    for (std::size_t n = block.begin; n < block.begin + length; ++n)
      if (is_scored(sequence, estimates, n)) baseline.add(estimates[n].value - sequence.target[n]);
  }
  if (baseline.samples == 0)
    throw Error(
        {.problem = "the model cannot be scored on these recordings: there is no measured " +
                    data.target + " where it is ready"});
  importance.rmse = baseline.rms();
  importance.samples = baseline.samples;
  importance.block_samples = length;
  importance.increase.assign(data.input_count(), std::vector<double>(repeats));
  const std::size_t runs = data.input_count() * repeats;
  SharedProgress shared(progress, 0.5, 1.0, runs * blocks.size(), "shuffling inputs");
  for_each_chunk(runs, threads, [&](std::size_t run) {
    const std::size_t input = run / repeats;
    const Shuffle shuffle = shuffled(input, blocks, seed + run);
    importance.increase[input][run % repeats] =
        shuffled_rmse(model, data, by_sequence, blocks, shuffle, length, shared) - importance.rmse;
  });
  return importance;
}

}  // namespace torsio
