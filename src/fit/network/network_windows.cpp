#include "fit/network/network_windows.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "signal/fit_normaliser.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr std::size_t kHeldOutShare = 5;  // one in so many

/// Calls `visit(begin, end)` for each stretch of a part in which every input is finite.
template <class Visit>
void for_each_run(const Sequence& sequence, const SequencePart& part, const Visit& visit) {
  std::size_t begin = part.begin;
  for (std::size_t n = part.begin; n <= part.end; ++n) {
    if (n < part.end && sequence.has_features(n)) continue;
    if (n > begin) visit(begin, n);
    begin = n + 1;
  }
}

/// Calls `visit(start)` for each window of a stretch.
template <class Visit>
void for_each_start(std::size_t begin, std::size_t end, const TrainingWindows& windows,
                    const Visit& visit) {
  if (end - begin < windows.length) return;
  const std::size_t last = end - windows.length;
  std::size_t start = begin;
  for (; start <= last; start += windows.stride) visit(start);
  if (start - windows.stride != last) visit(last);
}

std::size_t counted_in(std::span<const std::uint8_t> use, std::size_t start,
                       const TrainingWindows& windows) {
  const std::size_t first = windows.last_only ? windows.length - 1 : windows.burn_in;
  const auto window = use.subspan(start + first, windows.length - first);
  return static_cast<std::size_t>(
      std::ranges::count_if(window, [](std::uint8_t used) { return used != 0; }));
}

/// Calls `visit(sequence, n)` for each sample to learn from.
template <class Visit>
void for_each_used(const TrainingData& data, std::span<const SequencePart> parts,
                   const Visit& visit) {
  for (const SequencePart& part : parts) {
    const Sequence& sequence = data.sequences[part.sequence];
    for (std::size_t n = part.begin; n < part.end; ++n)
      if (sequence.use[n] != 0) visit(sequence, n);
  }
}

void reserve(WindowSet& set, std::size_t samples) {
  set.features.reserve(samples * set.inputs);
  set.targets.reserve(samples);
  set.use.reserve(samples);
}

/// Appends a sample, standardised.
void append(WindowSet& set, const Sequence& sequence, std::size_t n,
            const NetworkScaling& scaling) {
  for (std::size_t j = 0; j < set.inputs; ++j)
    set.features.push_back(static_cast<float>((sequence.features(n, j) - scaling.inputs.centre[j]) /
                                              scaling.inputs.scale[j]));
  const bool is_used = sequence.use[n] != 0;
  set.use.push_back(is_used ? 1 : 0);
  set.targets.push_back(is_used ? static_cast<float>((sequence.target[n] - scaling.target_centre) /
                                                     scaling.target_scale)
                                : 0.0F);
}

/// Calls `visit(start)` for each window of a part that has a sample in the loss.
template <class Visit>
void for_each_window(const Sequence& sequence, const SequencePart& part,
                     const TrainingWindows& windows, const Visit& visit) {
  for_each_run(sequence, part, [&](std::size_t begin, std::size_t end) {
    for_each_start(begin, end, windows, [&](std::size_t start) {
      if (counted_in(sequence.use, start, windows) > 0) visit(start);
    });
  });
}

bool has_window(const Sequence& sequence, const SequencePart& part,
                const TrainingWindows& windows) {
  bool found = false;
  for_each_window(sequence, part, windows, [&](std::size_t) { found = true; });
  return found;
}

/// The last fifth of a part, by samples.
TrainingSplit split_one(const Sequence& sequence, const SequencePart& part,
                        const TrainingWindows& windows, std::size_t embargo) {
  const std::size_t size = part.end - part.begin;
  const std::size_t cut = part.end - size / kHeldOutShare;
  const SequencePart late{part.sequence, cut, part.end};
  const SequencePart early{part.sequence, part.begin, cut - std::min(embargo, cut - part.begin)};
  if (!has_window(sequence, early, windows) || !has_window(sequence, late, windows))
    return {.training = {part}, .validation = {}, .held_out = {}};
  return {.training = {early},
          .validation = {late},
          .held_out = "the last fifth of " + sequence.recording};
}

}  // namespace

void WindowSet::fill(std::span<const std::size_t> windows, SequenceBatch& batch) const {
  const std::size_t rows = windows.size();
  // The windows lie anywhere in the data: the cache fetches several of them at once.
  for (const std::size_t window : windows) {
    const std::size_t sample = starts[window];
    __builtin_prefetch(features.data() + sample * inputs);
    __builtin_prefetch(features.data() + (sample + 1) * inputs - 1);
    __builtin_prefetch(targets.data() + sample);
    __builtin_prefetch(use.data() + sample);
  }
  batch.steps = steps;
  batch.rows = rows;
  batch.inputs.resize(steps * rows * inputs);
  batch.targets.resize(steps * rows);
  batch.weights.resize(steps * rows);
  const std::size_t first = last_only ? steps - 1 : burn_in;
  for (std::size_t t = 0; t < steps; ++t) {
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t sample = starts[windows[row]] + t;
      const std::size_t to = t * rows + row;
      std::copy_n(features.data() + sample * inputs, inputs, batch.inputs.data() + to * inputs);
      batch.targets[to] = targets[sample];
      batch.weights[to] = t >= first && use[sample] != 0 ? 1.0F : 0.0F;
    }
  }
}

std::size_t WindowSet::counted(std::size_t start) const {
  if (steps == 1) return use[start] != 0 ? 1 : 0;
  return counted_in(use, start, {.length = steps, .burn_in = burn_in, .last_only = last_only});
}

std::vector<SequencePart> whole_sequences(const TrainingData& data) {
  std::vector<SequencePart> parts;
  for (std::size_t s = 0; s < data.sequences.size(); ++s)
    parts.push_back({s, 0, data.sequences[s].target.size()});
  return parts;
}

TrainingSplit split_for_validation(const TrainingData& data, const TrainingWindows& windows,
                                   std::size_t embargo, std::uint64_t seed) {
  std::vector<SequencePart> parts;
  for (const SequencePart& part : whole_sequences(data))
    if (has_window(data.sequences[part.sequence], part, windows)) parts.push_back(part);
  if (parts.empty()) return {};
  if (parts.size() == 1)
    return split_one(data.sequences[parts.front().sequence], parts.front(), windows, embargo);

  Random random(seed);
  for (std::size_t k = parts.size(); k-- > 1;) std::swap(parts[k], parts[random.below(k + 1)]);
  const std::size_t held_out = std::max<std::size_t>(1, parts.size() / kHeldOutShare);
  const auto cut = parts.end() - static_cast<std::ptrdiff_t>(held_out);
  TrainingSplit split{.training = {parts.begin(), cut}, .validation = {cut, parts.end()}};
  std::ranges::sort(split.training, {}, &SequencePart::sequence);
  std::ranges::sort(split.validation, {}, &SequencePart::sequence);
  for (const SequencePart& part : split.validation)
    split.held_out +=
        (split.held_out.empty() ? "" : ", ") + data.sequences[part.sequence].recording;
  return split;
}

NetworkScaling scaling_of(const TrainingData& data, std::span<const SequencePart> parts) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for_each_used(data, parts, [&](const Sequence& sequence, std::size_t n) {
    if (!std::isfinite(sequence.target[n]) || !sequence.has_features(n))
      throw Error({.place = fmt::format("{}: sample {}", sequence.recording, n),
                   .expected = "finite inputs and a finite target where there is something to "
                               "learn",
                   .found = std::isfinite(sequence.target[n])
                                ? "an input that is not"
                                : fmt::format("{} = {}", data.target, sequence.target[n])});
    lowest = std::min(lowest, sequence.target[n]);
    highest = std::max(highest, sequence.target[n]);
  });
  const Normaliser inputs = fit_normaliser(data.input_count(), [&](const auto& take) {
    for_each_used(data, parts,
                  [&](const Sequence& sequence, std::size_t n) { take(sequence.features.row(n)); });
  });
  const Normaliser output = fit_normaliser(1, [&](const auto& take) {
    for_each_used(data, parts, [&](const Sequence& sequence, std::size_t n) {
      take(std::span(&sequence.target[n], 1));
    });
  });
  if (!(lowest < highest))
    throw Error({.place = data.target,
                 .expected = "a target that changes",
                 .found = fmt::format("{} in every training sample", lowest),
                 .advice = "Is the sensor connected? torsio check reports details."});
  return {.inputs = inputs.parameters(),
          .target_centre = output.parameters().centre.front(),
          .target_scale = output.parameters().scale.front()};
}

WindowSet make_windows(const TrainingData& data, std::span<const SequencePart> parts,
                       const NetworkScaling& scaling, const TrainingWindows& windows) {
  WindowSet set{.steps = windows.length,
                .burn_in = windows.burn_in,
                .last_only = windows.last_only,
                .inputs = data.input_count()};
  const bool is_single = windows.length == 1;
  std::size_t samples = 0;
  for (const SequencePart& part : parts) {
    if (!is_single) samples += part.end - part.begin;
    for_each_window(data.sequences[part.sequence], part, windows,
                    [&](std::size_t) { samples += is_single ? 1 : 0; });
  }
  reserve(set, samples);
  for (const SequencePart& part : parts) {
    const Sequence& sequence = data.sequences[part.sequence];
    const std::size_t base = set.use.size();
    for (std::size_t n = part.begin; !is_single && n < part.end; ++n)
      append(set, sequence, n, scaling);
    for_each_window(sequence, part, windows, [&](std::size_t start) {
      set.starts.push_back(is_single ? set.use.size() : base + start - part.begin);
      if (is_single) append(set, sequence, start, scaling);
    });
  }
  return set;
}

double linear_loss(const WindowSet& set) {
  const auto columns = static_cast<Eigen::Index>(set.inputs + 1);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd moment = Eigen::VectorXd::Zero(columns);
  Eigen::VectorXd row = Eigen::VectorXd::Ones(columns);
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t n = 0; n < set.targets.size(); ++n) {
    if (set.use[n] == 0) continue;
    for (std::size_t j = 0; j < set.inputs; ++j)
      row(static_cast<Eigen::Index>(j)) = static_cast<double>(set.features[n * set.inputs + j]);
    const auto target = static_cast<double>(set.targets[n]);
    normal += row * row.transpose();
    moment += target * row;
    squares += target * target;
    count += 1.0;
  }
  const Eigen::VectorXd solution = normal.completeOrthogonalDecomposition().solve(moment);
  return count > 0.0 ? std::max(0.0, (squares - solution.dot(moment)) / count) : 0.0;
}

}  // namespace torsio
