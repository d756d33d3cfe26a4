#include "fit/grey_box/residual_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "fit/common/folds.hpp"
#include "fit/common/guards.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "fit/grey_box/fit_input_products.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/network/fit_network.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kTrials = 3;
/// What a trial holds out has so many parts: the scatter of their gains is its standard error.
constexpr std::size_t kParts = 10;
constexpr std::uint8_t kNotScored = 0xff;

/// By sequence and sample: trial times `kParts` + part; `kNotScored`: in no trial.
using HeldOutParts = std::vector<std::vector<std::uint8_t>>;

/// What a box leaves over, with its slips as further inputs.
struct ResidualData {
  TrainingData samples;
  std::size_t slips = 0;         ///< the last inputs
  HeldOutParts of_records = {};  ///< recordings, or fifths of the only one
  HeldOutParts of_blocks = {};   ///< every fifth of 50 blocks of each recording, in one trial
};

/// Where the samples of one record are held out.
struct Holding {
  std::size_t record = 0;   ///< among those with samples in use
  std::size_t records = 0;  ///< their number
  std::size_t usable = 0;   ///< samples in use

  [[nodiscard]] std::uint8_t of_blocks(std::size_t used) const {
    return interleaved_fold(used, usable) == 0 ? static_cast<std::uint8_t>(used * kParts / usable)
                                               : kNotScored;
  }

  [[nodiscard]] std::uint8_t of_records(std::size_t used) const {
    if (records > 1)
      return static_cast<std::uint8_t>(record % std::min(records, kTrials) * kParts +
                                       used * kParts / usable);
    // The first, third and last fifth.
    constexpr std::size_t kFifths = 5;
    const std::size_t at = used * kFifths * kParts / usable;
    const std::size_t fifth = at / kParts;
    return fifth % 2 == 0 ? static_cast<std::uint8_t>(fifth / 2 * kParts + at % kParts)
                          : kNotScored;
  }
};

/// The residual of one record at every n-th of the samples in use; 0: at all samples, in use or not.
Sequence residual_of(const Sequence& sequence, const GreyBox::Parameters& parameters,
                     std::size_t stride, const Holding& holding,
                     std::vector<std::uint8_t>& of_records, std::vector<std::uint8_t>& of_blocks) {
  const std::size_t inputs = sequence.features.columns;
  const std::size_t slips = parameters.terms.thresholds.size();
  const bool whole = stride == 0;
  const std::size_t kept = whole ? sequence.target.size() : (holding.usable + stride - 1) / stride;
  Sequence own{.recording = sequence.recording, .features = Matrix(kept, inputs + slips)};
  GreyBox box(parameters);
  std::size_t used = 0;
  for (std::size_t n = 0; n < sequence.target.size(); ++n) {
    const auto features = sequence.features.row(n);
    const bool has_features = sequence.has_features(n);
    const double estimate = has_features ? box.step(features).value : 0.0;
    const bool is_used = sequence.use[n] != 0;
    const std::size_t place = used;
    if (is_used) ++used;
    if (!whole && (!is_used || place % stride != 0)) continue;
    const auto row = own.features.row(own.target.size());
    std::ranges::copy(features, row.begin());
    if (has_features) std::ranges::copy(box.state().first(slips), row.subspan(inputs).begin());
    own.target.push_back(sequence.target[n] - estimate);
    own.use.push_back(sequence.use[n]);
    of_records.push_back(is_used ? holding.of_records(place) : kNotScored);
    of_blocks.push_back(is_used ? holding.of_blocks(place) : kNotScored);
  }
  return own;
}

/// @param stride as `residual_of` takes it
ResidualData residual_data(const TrainingData& data, const GreyBox::Parameters& parameters,
                           std::size_t stride) {
  ResidualData left{.samples = {.inputs = data.inputs,
                                .target = data.target,
                                .sample_rate_Hz = data.sample_rate_Hz,
                                .sequences = {}},
                    .slips = parameters.terms.thresholds.size()};
  for (std::size_t i = 0; i < left.slips; ++i)
    left.samples.inputs.push_back({.expression = fmt::format("slip {}", i + 1)});
  std::vector<Holding> holdings;
  std::size_t records = 0;
  for (const Sequence& sequence : data.sequences) {
    const auto usable = static_cast<std::size_t>(std::ranges::count(sequence.use, 1));
    holdings.push_back({.record = records, .usable = usable});
    if (usable > 0) ++records;
  }
  for (Holding& holding : holdings) holding.records = records;
  left.samples.sequences.resize(data.sequences.size());
  left.of_records.resize(data.sequences.size());
  left.of_blocks.resize(data.sequences.size());
  for_each_chunk(data.sequences.size(), 0, [&](std::size_t s) {
    left.samples.sequences[s] = residual_of(data.sequences[s], parameters, stride, holdings[s],
                                            left.of_records[s], left.of_blocks[s]);
  });
  return left;
}

double root_mean_square(const TrainingData& data) {
  double sum = 0.0;
  double count = 0.0;
  for_each_usable(data, [&](Features, double target) {
    sum += target * target;
    ++count;
  });
  return std::sqrt(sum / std::max(count, 1.0));
}

/// One way to fit a residual.
struct Candidate {
  ResidualKind kind = ResidualKind::none;
  std::size_t degree = 0;  ///< products have one
  /// A network predicts other motions of the same kind well where it predicts blocks, and seldom a whole recording of
  /// another amplitude; what predicts this predicts more.
  bool is_tried_on_blocks = false;

  [[nodiscard]] const HeldOutParts& parts_of(const ResidualData& left) const {
    return is_tried_on_blocks ? left.of_blocks : left.of_records;
  }
  /// What a process gains on two recordings, each predicted from the other, did not carry over to other motions; the
  /// same is asked of a network.
  [[nodiscard]] bool needs_all_trials() const {
    return kind == ResidualKind::gp || (kind == ResidualKind::mlp && !is_tried_on_blocks);
  }
};

constexpr std::array kCandidates{
    Candidate{.kind = ResidualKind::mlp, .is_tried_on_blocks = true},
    Candidate{.kind = ResidualKind::mlp}, Candidate{.kind = ResidualKind::products, .degree = 2},
    Candidate{.kind = ResidualKind::products, .degree = 3}, Candidate{.kind = ResidualKind::gp}};

std::string text_of(const Candidate& candidate) {
  switch (candidate.kind) {
    case ResidualKind::mlp: return "a network";
    case ResidualKind::products:
      return fmt::format("products of {} inputs", candidate.degree == 2 ? "two" : "three");
    default: return "a Gaussian process";
  }
}

/// Only values: the error bar is that of the held-out errors.
ParametricGp::Parameters fitted_gp(const TrainingData& data, const FitContext& context) {
  const VariationalGpOptions options{
      .kernel = "se_ard", .inducing_points = 24, .samples = 1500, .iterations = 40};
  ParametricGp::Parameters parameters = fit_variational_gp(data, options, context).parameters;
  parameters.explained = {};
  return parameters;
}

GreyBoxResidual fitted_residual(const ResidualData& left, const Candidate& candidate, double bound,
                                const FitContext& context) {
  const TrainingData& data = left.samples;
  GreyBoxResidual residual{.bound = bound * root_mean_square(data)};
  switch (candidate.kind) {
    case ResidualKind::dgmm:
      residual.model = fit_dgmm(data, {.online = {.components = 50}}, context.progress).parameters;
      break;
    case ResidualKind::products:
      residual.model = fit_input_products(data, candidate.degree, left.slips);
      break;
    case ResidualKind::gp: residual.model = fitted_gp(data, context); break;
    default:
      residual.model =
          fit_mlp(data, {.layers = {16, 16}, .activation = Activation::tanh}, context).parameters;
  }
  FeatureRanges ranges = feature_ranges(data);
  residual.lowest = std::move(ranges.lowest);
  residual.highest = std::move(ranges.highest);
  return residual;
}

/// What is held out of one trial, and what a residual achieves there.
struct PartScore {
  double without = 0.0;  ///< sum of squares
  double with = 0.0;
  double samples = 0.0;
};
using Scores = std::array<PartScore, kTrials * kParts>;

void run_trial(const ResidualData& left, std::size_t trial, const Candidate& candidate,
               double bound, const FitContext& context, Scores& scores) {
  const HeldOutParts& parts = candidate.parts_of(left);
  ResidualData others{.samples = left.samples, .slips = left.slips};
  for (std::size_t s = 0; s < parts.size(); ++s)
    for (std::size_t n = 0; n < parts[s].size(); ++n)
      if (parts[s][n] / kParts == trial) others.samples.sequences[s].use[n] = 0;
  GreyBoxCorrection correction(fitted_residual(others, candidate, bound, context));
  for (std::size_t s = 0; s < parts.size(); ++s) {
    const Sequence& sequence = left.samples.sequences[s];
    for (std::size_t n = 0; n < parts[s].size(); ++n) {
      if (parts[s][n] / kParts != trial) continue;
      const double error = sequence.target[n] - correction.value(sequence.features.row(n));
      PartScore& score = scores.at(parts[s][n]);
      score.without += sequence.target[n] * sequence.target[n];
      score.with += error * error;
      ++score.samples;
    }
  }
}

/// Shares of the mean square error on what was held out.
struct Gain {
  double mean = -std::numeric_limits<double>::infinity();
  double std_error = 0.0;
  double least = 0.0;  ///< the lowest one of a trial

  [[nodiscard]] bool is_worthwhile() const {
    constexpr double kLeast = 0.04;
    return mean > std::max(kLeast, std_error) && least > 0.0;
  }
};

Gain gain_of(const Scores& scores) {
  double without = 0.0;
  double with = 0.0;
  double samples = 0.0;
  for (const PartScore& part : scores) {
    without += part.without;
    with += part.with;
    samples += part.samples;
  }
  if (!(without > 0.0) || !std::isfinite(with)) return {};
  const double mean = (without - with) / samples;
  double squares = 0.0;
  double parts = 0.0;
  for (const PartScore& part : scores) {
    if (part.samples == 0.0) continue;
    const double off = (part.without - part.with) / part.samples - mean;
    squares += off * off;
    ++parts;
  }
  const double unit = without / samples;
  Gain gain{.mean = mean / unit, .std_error = std::sqrt(squares / (parts - 1.0) / parts) / unit};
  gain.least = gain.mean;
  for (std::size_t trial = 0; trial < kTrials; ++trial) {
    PartScore sum;
    for (std::size_t part = trial * kParts; part < (trial + 1) * kParts; ++part) {
      sum.without += scores.at(part).without;
      sum.with += scores.at(part).with;
    }
    if (sum.without > 0.0) gain.least = std::min(gain.least, 1.0 - sum.with / sum.without);
  }
  return gain;
}

std::size_t trials_in(const HeldOutParts& parts) {
  std::size_t trials = 0;
  for (const std::vector<std::uint8_t>& of_record : parts)
    for (const std::uint8_t part : of_record)
      if (part != kNotScored) trials = std::max<std::size_t>(trials, part / kParts + 1);
  return trials;
}

/// The gain of each candidate.
std::array<Gain, kCandidates.size()> tried(const ResidualData& left, const GreyBoxOptions& options,
                                           const FitContext& context) {
  struct Job {
    std::size_t candidate = 0;
    std::size_t trial = 0;
  };
  std::vector<Job> jobs;
  for (std::size_t c = 0; c < kCandidates.size(); ++c) {
    const std::size_t trials = trials_in(kCandidates.at(c).parts_of(left));
    if (kCandidates.at(c).needs_all_trials() && trials < kTrials) continue;
    for (std::size_t t = 0; t < trials; ++t) jobs.push_back({c, t});
  }
  std::array<Scores, kCandidates.size()> scores{};
  // One for each job, which run at the same time. A candidate that cannot be fitted is none for these data.
  std::vector<std::uint8_t> has_failed(jobs.size(), 0);
  ProgressOfParts progress(context.progress, jobs.size());
  for_each_chunk(jobs.size(), 0, [&](std::size_t job) {
    const std::size_t candidate = jobs[job].candidate;
    try {
      run_trial(left, jobs[job].trial, kCandidates.at(candidate), options.bound,
                {.seed = context.seed, .progress = progress.part(job)}, scores.at(candidate));
    } catch (const Cancelled&) {
      throw;
    } catch (const Error&) {
      has_failed[job] = 1;
    }
  });
  std::array<Gain, kCandidates.size()> gains{};
  for (std::size_t c = 0; c < gains.size(); ++c) gains.at(c) = gain_of(scores.at(c));
  for (std::size_t job = 0; job < jobs.size(); ++job)
    if (has_failed[job] != 0) gains.at(jobs[job].candidate) = {};
  return gains;
}

std::string note_of(const Candidate& candidate, const Gain& gain, bool has_records) {
  const char* const held_out = candidate.is_tried_on_blocks ? "blocks"
                               : has_records                ? "recordings"
                                                            : "fifths";
  const double share = std::sqrt(1.0 - gain.mean);
  return fmt::format(
      "{} for the residual was {}: on held-out {} it changes the RMSE by {:+.1f} % (standard error "
      "{:.1f} %)",
      text_of(candidate), gain.is_worthwhile() ? "added" : "not added", held_out,
      100.0 * (share - 1.0), 50.0 * gain.std_error / share);
}

/// The process if it is worthwhile, since it only describes what is near its data, else the best of the others that were
/// tried on recordings, else the network that was tried on blocks; if none is, the best one of the former.
std::size_t place_of_best(const std::array<Gain, kCandidates.size()>& gains) {
  const auto better = [&](std::size_t a, std::size_t b) {
    const auto rank = [&](std::size_t c) {
      const bool is_worthwhile = gains.at(c).is_worthwhile();
      return std::tuple(is_worthwhile, !kCandidates.at(c).is_tried_on_blocks,
                        is_worthwhile && kCandidates.at(c).kind == ResidualKind::gp,
                        gains.at(c).mean);
    };
    return rank(a) > rank(b);
  };
  std::size_t best = 0;
  for (std::size_t c = 1; c < gains.size(); ++c)
    if (better(c, best)) best = c;
  return best;
}

}  // namespace

ChosenResidual chosen_residual(const TrainingData& data, const GreyBox::Parameters& box,
                               const GreyBoxOptions& options, const FitContext& context) {
  ChosenResidual chosen;
  Candidate best{.kind = options.residual, .degree = InputProducts::kHighestDegree};
  if (options.residual == ResidualKind::automatic) {
    constexpr std::size_t kMaxTried = 40000;
    const std::size_t stride = std::max<std::size_t>(1, data.usable_samples() / kMaxTried);
    const ResidualData left = residual_data(data, box, stride);
    const auto gains = tried(left, options, context);
    const std::size_t place = place_of_best(gains);
    best = kCandidates.at(place);
    const Gain& gain = gains.at(place);
    if (!std::isfinite(gain.mean)) return chosen;
    const auto has_samples = [](const std::vector<std::uint8_t>& parts) { return !parts.empty(); };
    chosen.note = note_of(best, gain, std::ranges::count_if(left.of_records, has_samples) > 1);
    if (!gain.is_worthwhile()) return chosen;
    chosen.rmse_share = std::sqrt(1.0 - gain.mean);
  }
  // A mixture names a sample that it refuses, and a network holds out the end of a single record.
  const bool whole = best.kind == ResidualKind::dgmm || data.sequences.size() == 1;
  chosen.residual =
      fitted_residual(residual_data(data, box, whole ? 0 : 1), best, options.bound, context);
  return chosen;
}

}  // namespace torsio
