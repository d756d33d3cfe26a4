#include "fit/network/fit_network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

#include "core/checks.hpp"
#include "core/fnv_hash.hpp"
#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/network/fit_ensemble.hpp"
#include "fit/network/network_initialisation.hpp"
#include "fit/network/network_trainer.hpp"
#include "fit/network/network_windows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

using Kind = TrainingLayer::Kind;

void require_option(bool is_good, std::string_view option, std::string_view expected,
                    std::string_view found) {
  require<UsageError>(is_good, fmt::format("option {}", option), expected, found);
}

void check_layers(const std::vector<std::size_t>& layers, std::size_t fewest) {
  require_option(layers.size() >= fewest && layers.size() < kMaxLayers, "layers",
                 fmt::format("{} to {} layers", fewest, kMaxLayers - 1),
                 fmt::format("{}", layers.size()));
  for (const std::size_t units : layers)
    require_option(units >= 1 && units <= kMaxUnits, "layers",
                   fmt::format("1 to {} units a layer", kMaxUnits), fmt::format("{}", units));
}

void check(const NetworkTraining& training) {
  const auto is_from = [](double value, double least) {
    return std::isfinite(value) && value >= least;
  };
  require_option(training.epochs >= 1, "epochs", "at least 1", "0");
  require_option(training.batch >= 1, "batch", "at least 1", "0");
  require_option(is_from(training.learning_rate, 0.0) && training.learning_rate > 0.0,
                 "learning_rate", "a positive number", as_text(training.learning_rate));
  require_option(is_from(training.weight_decay, 0.0), "weight_decay", "a number from 0",
                 as_text(training.weight_decay));
  require_option(is_from(training.clip, 0.0), "clip", "a number from 0", as_text(training.clip));
}

void check(const TrainingWindows& windows) {
  require_option(windows.length >= 1, "window", "at least 1 sample", "0");
  require_option(windows.stride >= 1, "stride", "at least 1 sample", "0");
  require_option(windows.last_only || windows.burn_in < windows.length, "burn_in",
                 fmt::format("less than the window of {} samples", windows.length),
                 fmt::format("{}", windows.burn_in));
}

void check_fits_a_file(const TrainingNetwork& network, std::size_t members) {
  const std::size_t bytes = members * network.parameter_count() * sizeof(float);
  if (bytes <= kMaxModelFileBytes) return;
  throw UsageError(
      {.place = "layers",
       .expected = fmt::format("networks of at most {} MiB together, as model files are",
                               kMaxModelFileBytes >> 20),
       .found = fmt::format("{} parameters{}, {} MiB", network.parameter_count(),
                            members == 1 ? "" : fmt::format(" in each of {} members", members),
                            bytes >> 20),
       .advice = members == 1 ? "Take fewer or smaller layers."
                              : "Take fewer members, or fewer or smaller layers."});
}

void add(FnvHash& hash, const WindowSet& set) {
  for (const float value : set.features) hash.add(std::bit_cast<std::uint32_t>(value));
  for (const float value : set.targets) hash.add(std::bit_cast<std::uint32_t>(value));
  for (const std::size_t window : set.starts) hash.add(window);
}

std::string recipe_of(std::string_view family, const TrainingNetwork& network,
                      const NetworkTraining& training, const WindowSet& set,
                      const WindowSet& validation, std::uint64_t seed) {
  FnvHash data;  // changes with the data
  add(data, set);
  add(data, validation);
  std::string layers;
  for (const TrainingLayer& layer : network.layers())
    layers += fmt::format("{}{}x{}:{}", layers.empty() ? "" : " ", layer.inputs, layer.units,
                          static_cast<int>(layer.activation));
  return fmt::format(
      "{} [{}], window {} burn_in {} last_only {}, epochs {} batch {} learning_rate {} optimiser "
      "{} weight_decay {} clip {} schedule {} patience {}, seed {}, data {:016x}",
      family, layers, set.steps, set.burn_in, set.last_only, training.epochs, training.batch,
      training.learning_rate, static_cast<int>(training.optimiser), training.weight_decay,
      training.clip, static_cast<int>(training.schedule), training.patience, seed, data.value());
}

/// The data in the form that the trainer uses.
struct Material {
  NetworkScaling scaling;
  WindowSet training;
  WindowSet validation;
  std::string decided_by;  ///< what the validation loss is of, in words; empty: there is none
};

Material prepare(const TrainingData& data, const TrainingWindows& windows, std::size_t embargo,
                 const FitContext& context) {
  require_samples(data);
  TrainingSplit split;
  if (context.validation != nullptr) {
    split.training = whole_sequences(data);
  } else {
    split = split_for_validation(data, windows, embargo, context.seed);
    if (split.training.empty())
      split.training = whole_sequences(data);  // the error is reported below
  }
  Material material{.scaling = scaling_of(data, split.training),
                    .training = {},
                    .validation = {},
                    .decided_by = split.held_out};
  material.training = make_windows(data, split.training, material.scaling, windows);
  if (material.training.starts.empty()) {
    std::size_t longest = 0;
    for (const Sequence& sequence : data.sequences)
      longest = std::max(longest, sequence.target.size());
    throw Error(
        {.place = "training records",
         .expected = fmt::format("a stretch of {} samples (one window) with finite inputs and "
                                 "a measured {} after the burn-in",
                                 windows.length, data.target),
         .found = fmt::format("none; the longest record has {} samples", longest),
         .advice = "Set a shorter window, or give longer records."});
  }
  TrainingWindows apart = windows;  // every sample is scored about once
  apart.stride =
      std::max(windows.stride, windows.length - std::min(windows.burn_in, windows.length - 1));
  if (context.validation != nullptr) {
    material.validation = make_windows(*context.validation, whole_sequences(*context.validation),
                                       material.scaling, apart);
    material.decided_by = "the validation records";
  } else if (!split.validation.empty()) {
    material.validation = make_windows(data, split.validation, material.scaling, apart);
  }
  return material;
}

/// What came out of a training, with what it was trained on.
struct Outcome {
  TrainedNetwork network;
  Material material;
  std::size_t starts = 1;
  double training_loss = 0.0;  ///< standardised mean square error on the training windows
  double linear_loss = 0.0;    ///< the same for a linear model
};

bool is_worse_than_linear(const Outcome& outcome) {
  constexpr double kClearly = 1.21;     // an RMSE of 1.1 times
  constexpr double kNegligible = 1e-6;  // an RMSE of a thousandth of the standard deviation
  return outcome.training_loss > kClearly * outcome.linear_loss + kNegligible;
}

std::vector<std::string> notes_of(const Outcome& outcome, const TrainingData& data,
                                  std::size_t epochs) {
  const TrainedNetwork& trained = outcome.network;
  const Material& material = outcome.material;
  const double rmse = std::sqrt(trained.best_loss) * material.scaling.target_scale;
  const bool is_validated = !material.validation.starts.empty();
  std::vector<std::string> notes;
  notes.push_back(fmt::format("weights of epoch {} of {}: RMSE {:.4g} in the unit of {} on {}",
                              trained.best_epoch, trained.epochs, rmse, data.target,
                              is_validated ? material.decided_by : "the training windows"));
  if (!trained.end.empty()) notes.push_back(fmt::format("training ended: {}", trained.end));
  if (trained.best_loss >= 1.0)
    notes.emplace_back(
        "the network is no better than a constant: try a smaller learning_rate, more epochs or "
        "other inputs");
  if (trained.end.empty() && trained.best_epoch == epochs)
    notes.emplace_back("the last epoch was the best: more epochs may do better");
  if (!is_validated)
    notes.emplace_back("too little data to hold any out: nothing guarded against overfitting");
  if (outcome.starts > 1)
    notes.push_back(
        fmt::format("trained from {} starts: the first ended above the error of a linear model",
                    outcome.starts));
  if (is_worse_than_linear(outcome))
    notes.push_back(fmt::format(
        "warning: on its own training data the network is worse than a linear model: RMSE {:.4g} "
        "instead of {:.4g} {}; more epochs, another learning_rate or other inputs may help",
        std::sqrt(outcome.training_loss) * material.scaling.target_scale,
        std::sqrt(outcome.linear_loss) * material.scaling.target_scale, unit_label(data.target)));
  return notes;
}

template <class Family>
Trained<Family> result_of(typename Family::Parameters parameters, Outcome outcome,
                          const TrainingData& data, std::size_t epochs) {
  std::vector<std::string> notes = notes_of(outcome, data, epochs);
  const double loss = outcome.network.best_loss;
  const double rmse = std::sqrt(loss) * outcome.material.scaling.target_scale;
  return {std::move(parameters), std::move(outcome.network.weights), loss, rmse, std::move(notes)};
}

/// What there is to train: which layers, and how.
struct Job {
  std::string_view family;
  TrainingNetwork network;
  NetworkTraining training;
  TrainingWindows windows;
  std::size_t embargo = 0;
  EnsembleMember member;
};

/// The network of a member that an earlier call has come to the end of.
TrainedNetwork finished_network(const Job& job) {
  const std::size_t parameters = job.network.parameter_count();
  if (job.member.finished.size() != parameters)
    throw Error({.place = "checkpoint",
                 .expected = fmt::format("{} weights of {}", parameters, job.member.name),
                 .found = fmt::format("{}", job.member.finished.size())});
  return {.weights = {job.member.finished.begin(), job.member.finished.end()},
          .best_loss = job.member.finished_loss,
          .end = {}};
}

/// A training that ended early above the error of a linear model is run again from other weights.
constexpr std::size_t kMaxStarts = 3;

std::uint64_t seed_of_start(std::uint64_t seed, std::size_t start) {
  return start == 0 ? seed : Random(~seed + start).bits();
}

/// The part that the three fits have in common.
/// @param put_initial (weights, random) sets the weights of a start
template <class PutInitial>
Outcome train(const Job& job, const TrainingData& data, const FitContext& context,
              const PutInitial& put_initial) {
  check(job.training);
  check(job.windows);
  check_fits_a_file(job.network, job.member.of);
  report_progress(context.progress, 0.0, fmt::format("fitting {}", job.family));
  Outcome outcome{.network = {}, .material = prepare(data, job.windows, job.embargo, context)};
  const WindowSet& training = outcome.material.training;
  NetworkTrainer trainer(job.network, job.training);
  require_memory({.what = "the training",
                  .bytes = trainer.bytes(training.steps, training.starts.size()),
                  .advice = "Take fewer or smaller layers, shorter windows or smaller batches."});
  if (!job.member.finished.empty()) {
    outcome.network = finished_network(job);
    return outcome;
  }
  const auto recipe_of_start = [&](std::size_t start) {
    return recipe_of(job.family, job.network, job.training, training, outcome.material.validation,
                     seed_of_start(context.seed, start)) +
           job.member.name;
  };
  std::size_t resumed = 0;  // the start that the checkpoint is of
  for (std::size_t start = 1; context.resume != nullptr && start < kMaxStarts; ++start)
    if (context.resume->recipe == recipe_of_start(start)) resumed = start;
  outcome.linear_loss = linear_loss(training);
  for (std::size_t start = 0; start < kMaxStarts; ++start) {
    FitContext own = context;
    own.seed = seed_of_start(context.seed, start);
    if (start != resumed) own.resume = nullptr;
    std::vector<float> weights(job.network.parameter_count(), 0.0F);
    Random random(own.seed);
    put_initial(weights.data(), random);
    TrainedNetwork trained =
        train_network(trainer, job.training, training, outcome.material.validation,
                      std::move(weights), recipe_of_start(start), own);
    const double loss = trainer.loss(trained.weights, training);
    const bool ended_early = !trained.end.empty();
    if (start == 0 || loss < outcome.training_loss) {
      outcome.network = std::move(trained);
      outcome.training_loss = loss;
    }
    outcome.starts = start + 1;
    if (!ended_early || !is_worse_than_linear(outcome)) break;
  }
  return outcome;
}

/// Dense layers in series, the last one linear with one output.
void append_dense(std::vector<TrainingLayer>& layers, std::size_t inputs,
                  const std::vector<std::size_t>& hidden, Activation activation) {
  for (const std::size_t units : hidden) {
    layers.push_back({Kind::dense, inputs, units, activation});
    inputs = units;
  }
  layers.push_back({Kind::dense, inputs, 1, Activation::linear});
}

void put_initial_dense(const TrainingNetwork& network, std::size_t first, Random& random,
                       float* weights) {
  for (std::size_t l = first; l < network.layers().size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    put_layer(initial_dense(layer.inputs, layer.units, layer.activation, random), network, l,
              weights);
  }
}

/// What one family with memory does its own way.
struct LstmWay {
  using Family = Lstm;
  static constexpr Kind kKind = Kind::lstm;
  static constexpr auto kInitial = initial_lstm;
  static constexpr auto kTake = lstm_layer;
};
struct GruWay {
  using Family = Gru;
  static constexpr Kind kKind = Kind::gru;
  static constexpr auto kInitial = initial_gru;
  static constexpr auto kTake = gru_layer;
};

template <class Way>
Trained<typename Way::Family> train_recurrent(const TrainingData& data,
                                              const RecurrentOptions& options,
                                              const FitContext& context,
                                              const EnsembleMember& member) {
  check_layers(options.layers, 1);
  check_layers(options.head, 0);
  std::vector<TrainingLayer> layers;
  std::size_t inputs = data.input_count();
  for (const std::size_t units : options.layers) {
    layers.push_back({Way::kKind, inputs, units});
    inputs = units;
  }
  append_dense(layers, inputs, options.head, options.head_activation);
  const Job job{.family = Way::Family::kFamily,
                .network = TrainingNetwork(std::move(layers)),
                .training = options.training,
                .windows = options.windows,
                .embargo = options.windows.length,
                .member = member};
  const TrainingNetwork& network = job.network;
  const std::size_t depth = options.layers.size();
  Outcome outcome = train(job, data, context, [&](float* weights, Random& random) {
    for (std::size_t l = 0; l < depth; ++l)
      put_layer(Way::kInitial(network.layers()[l].inputs, network.layers()[l].units, random),
                network, l, weights);
    put_initial_dense(network, depth, random, weights);
  });
  typename Way::Family::Parameters parameters;
  parameters.scaling = outcome.material.scaling;
  for (std::size_t l = 0; l < depth; ++l)
    parameters.layers.push_back(Way::kTake(network, l, outcome.network.weights.data()));
  for (std::size_t l = depth; l < network.layers().size(); ++l)
    parameters.head.push_back(dense_layer(network, l, outcome.network.weights.data()));
  parameters.sample_period_s = 1.0 / data.sample_rate_Hz;
  parameters.warm_up_samples = options.windows.length;
  return result_of<typename Way::Family>(std::move(parameters), std::move(outcome), data,
                                         options.training.epochs);
}

// A static network's samples are highly correlated over short times: training and validation
// samples are separated by a hundredth of a record.
std::size_t static_embargo(const TrainingData& data) {
  std::size_t longest = 0;
  for (const Sequence& sequence : data.sequences)
    longest = std::max(longest, sequence.target.size());
  return longest / 100;
}

Trained<Mlp> train_mlp(const TrainingData& data, const MlpOptions& options,
                       const FitContext& context, const EnsembleMember& member) {
  check_layers(options.layers, 0);
  std::vector<TrainingLayer> layers;
  append_dense(layers, data.input_count(), options.layers, options.activation);
  const Job job{.family = Mlp::kFamily,
                .network = TrainingNetwork(std::move(layers)),
                .training = options.training,
                .windows = {.length = 1, .stride = 1, .burn_in = 0},
                .embargo = static_embargo(data),
                .member = member};
  Outcome outcome = train(job, data, context, [&](float* weights, Random& random) {
    put_initial_dense(job.network, 0, random, weights);
  });
  Mlp::Parameters parameters;
  parameters.scaling = outcome.material.scaling;
  for (std::size_t l = 0; l < job.network.layers().size(); ++l)
    parameters.layers.push_back(dense_layer(job.network, l, outcome.network.weights.data()));
  return result_of<Mlp>(std::move(parameters), std::move(outcome), data, options.training.epochs);
}

template <class Family>
Fitted<Family> fitted(Trained<Family> trained) {
  return {std::move(trained.parameters), std::move(trained.notes)};
}

}  // namespace

std::span<const std::string_view> activation_names() noexcept {
  static const std::array<std::string_view, 5> names{
      name(Activation::linear), name(Activation::relu), name(Activation::tanh),
      name(Activation::softsign), name(Activation::elu)};
  return names;
}

Fitted<Mlp> fit_mlp(const TrainingData& data, const MlpOptions& options,
                    const FitContext& context) {
  return fitted(train_mlp(data, options, context, {}));
}

Fitted<Lstm> fit_lstm(const TrainingData& data, const RecurrentOptions& options,
                      const FitContext& context) {
  return fitted(train_recurrent<LstmWay>(data, options, context, {}));
}

Fitted<Gru> fit_gru(const TrainingData& data, const RecurrentOptions& options,
                    const FitContext& context) {
  return fitted(train_recurrent<GruWay>(data, options, context, {}));
}

Fitted<MlpEnsemble> fit_mlp_ensemble(const TrainingData& data, const MlpOptions& options,
                                     std::size_t members, const FitContext& context) {
  return fit_ensemble<Mlp>(members, context,
                           [&](const FitContext& own, const EnsembleMember& member) {
                             return train_mlp(data, options, own, member);
                           });
}

Fitted<LstmEnsemble> fit_lstm_ensemble(const TrainingData& data, const RecurrentOptions& options,
                                       std::size_t members, const FitContext& context) {
  return fit_ensemble<Lstm>(members, context,
                            [&](const FitContext& own, const EnsembleMember& member) {
                              return train_recurrent<LstmWay>(data, options, own, member);
                            });
}

Fitted<GruEnsemble> fit_gru_ensemble(const TrainingData& data, const RecurrentOptions& options,
                                     std::size_t members, const FitContext& context) {
  return fit_ensemble<Gru>(members, context,
                           [&](const FitContext& own, const EnsembleMember& member) {
                             return train_recurrent<GruWay>(data, options, own, member);
                           });
}

}  // namespace torsio
