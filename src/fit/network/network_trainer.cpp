#include "fit/network/network_trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fit/network/layer_kernels.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

// Windows per chunk: few enough that a batch of 64 keeps four threads busy, enough for matrix
// products at full speed. Steps of a static network are too short to be shared.
constexpr std::size_t kChunkWithState = 16;
constexpr std::size_t kChunkStatic = 256;

// The target is standardised: a constant has a loss of 1.
constexpr double kExplodedLoss = 1e6;

constexpr double kBeta1 = 0.9;
constexpr double kBeta2 = 0.999;

double square_sum(std::span<const float> values) {
  std::array<double, 8> sums{};
  std::size_t k = 0;
  for (; k + 8 <= values.size(); k += 8)
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const auto value = static_cast<double>(values[k + lane]);
      sums[lane] += value * value;
    }
  for (; k < values.size(); ++k)
    sums[0] += static_cast<double>(values[k]) * static_cast<double>(values[k]);
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

std::vector<std::size_t> all_windows(const WindowSet& set) {
  std::vector<std::size_t> windows(set.starts.size());
  std::iota(windows.begin(), windows.end(), std::size_t{0});
  return windows;
}

std::size_t counted_samples(const WindowSet& set, std::span<const std::size_t> windows) {
  std::size_t count = 0;
  for (const std::size_t window : windows) count += set.counted(set.starts[window]);
  return count;
}

}  // namespace

/// A workspace that no other chunk is using.
class NetworkTrainer::Lease {
 public:
  explicit Lease(NetworkTrainer& trainer) : trainer_(trainer) {
    const std::scoped_lock lock(trainer_.guard_);
    if (trainer_.idle_.empty()) {
      workspace_ = std::make_unique<Workspace>();
    } else {
      workspace_ = std::move(trainer_.idle_.back());
      trainer_.idle_.pop_back();
    }
  }
  ~Lease() {
    const std::scoped_lock lock(trainer_.guard_);
    trainer_.idle_.push_back(std::move(workspace_));
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

  Workspace& operator*() const noexcept { return *workspace_; }

 private:
  NetworkTrainer& trainer_;
  std::unique_ptr<Workspace> workspace_;
};

NetworkTrainer::NetworkTrainer(TrainingNetwork network, const NetworkTraining& settings)
    : network_(std::move(network)),
      settings_(settings),
      chunk_rows_(std::ranges::any_of(network_.layers(), &TrainingLayer::has_state)
                      ? kChunkWithState
                      : kChunkStatic) {}

double NetworkTrainer::bytes(std::size_t steps, std::size_t windows) const noexcept {
  const std::size_t batch = std::min(settings_.batch, windows);
  const std::size_t chunks = chunks_of(batch);
  const std::size_t threads = settings_.threads == 0 ? usual_threads() : settings_.threads;
  // A gradient of each chunk; weights, best weights, their packed copies and the optimiser's state.
  const auto tables = static_cast<double>(chunks + 8);
  const auto passes = static_cast<double>(std::min(threads, chunks));
  return tables * static_cast<double>(network_.parameter_count() * sizeof(float)) +
         passes * static_cast<double>(network_.pass_bytes(steps, std::min(batch, chunk_rows_)));
}

std::span<const std::size_t> NetworkTrainer::chunk(std::span<const std::size_t> windows,
                                                   std::size_t index) const noexcept {
  const std::size_t begin = index * chunk_rows_;
  return windows.subspan(begin, std::min(chunk_rows_, windows.size() - begin));
}

double NetworkTrainer::loss_and_gradient(const std::vector<float>& weights, const WindowSet& set,
                                         std::span<const std::size_t> windows) {
  packed_.pack(network_, weights.data());
  const std::size_t chunks = chunks_of(windows.size());
  const std::size_t size = network_.parameter_count();
  gradients_.resize(std::max(gradients_.size(), chunks * size));
  std::vector<double> errors(chunks, 0.0);
  const auto count = static_cast<double>(counted_samples(set, windows));
  for_each_chunk(chunks, settings_.threads, [&](std::size_t index) {
    const Lease lease(*this);
    auto& [batch, pass] = *lease;
    float* const gradient = gradients_.data() + index * size;
    std::fill_n(gradient, size, 0.0F);
    set.fill(chunk(windows, index), batch);
    pass.forward(network_, packed_, batch);
    errors[index] = pass.square_error(batch);
    pass.backward(network_, packed_, batch, static_cast<float>(2.0 / count), gradient);
  });
  for (std::size_t index = 1; index < chunks; ++index) {
    const float* const part = gradients_.data() + index * size;
    for (std::size_t k = 0; k < size; ++k) gradients_[k] += part[k];
  }
  return std::accumulate(errors.begin(), errors.end(), 0.0) / count;
}

double NetworkTrainer::update(TrainingCheckpoint& state, const WindowSet& set,
                              std::span<const std::size_t> windows, double learning_rate) {
  const double loss = loss_and_gradient(state.weights, set, windows);
  const double norm = std::sqrt(square_sum(gradient()));
  if (!std::isfinite(loss) || !std::isfinite(norm)) return kNotMeasured;
  const double scale = settings_.clip > 0.0 ? std::min(1.0, settings_.clip / (norm + 1e-6)) : 1.0;
  ++state.updates;
  apply(state, learning_rate, scale);
  return loss;
}

void NetworkTrainer::apply(TrainingCheckpoint& state, double learning_rate,
                           double gradient_scale) const {
  const auto update = static_cast<double>(state.updates);
  const layer_kernels::AdamStep of_biases{
      .rate = static_cast<float>(learning_rate / (1.0 - std::pow(kBeta1, update))),
      .root_scale = static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(kBeta2, update))),
      .decay = 0.0F,
      .penalty = 0.0F,
      .gradient_scale = static_cast<float>(gradient_scale)};
  const auto step = [&](const layer_kernels::AdamStep& how, std::size_t at, std::size_t count) {
    layer_kernels::adam(how, gradients_.data() + at, state.weights.data() + at,
                        state.mean.data() + at, state.square.data() + at, count);
  };
  if (settings_.weight_decay == 0.0) return step(of_biases, 0, network_.parameter_count());
  layer_kernels::AdamStep of_weights = of_biases;
  if (settings_.optimiser == Optimiser::adamw) {
    of_weights.decay = static_cast<float>(learning_rate * settings_.weight_decay);
  } else {
    of_weights.penalty = static_cast<float>(settings_.weight_decay);
  }
  for (const ParameterBlock& block : network_.blocks()) {
    const std::size_t bias = block.begins_with_bias ? block.columns : 0;
    step(of_biases, block.offset, bias);
    step(of_weights, block.offset + bias, block.rows * block.columns - bias);
  }
}

double NetworkTrainer::loss(const std::vector<float>& weights, const WindowSet& set) {
  packed_.pack(network_, weights.data());
  const std::vector<std::size_t> windows = all_windows(set);
  const std::size_t chunks = chunks_of(windows.size());
  std::vector<double> errors(chunks, 0.0);
  for_each_chunk(chunks, settings_.threads, [&](std::size_t index) {
    const Lease lease(*this);
    auto& [batch, pass] = *lease;
    set.fill(chunk(windows, index), batch);
    pass.forward(network_, packed_, batch);
    errors[index] = pass.square_error(batch);
  });
  return std::accumulate(errors.begin(), errors.end(), 0.0) /
         static_cast<double>(counted_samples(set, windows));
}

double learning_rate_at(const NetworkTraining& settings, std::size_t update,
                        std::size_t updates_in_all) noexcept {
  const double done = static_cast<double>(update) / static_cast<double>(updates_in_all);
  switch (settings.schedule) {
    case RateSchedule::constant: break;
    case RateSchedule::cosine:
      return settings.learning_rate * 0.5 * (1.0 + std::cos(std::numbers::pi * done));
    case RateSchedule::step:
      return settings.learning_rate * (done < 0.5 ? 1.0 : done < 0.75 ? 0.1 : 0.01);
  }
  return settings.learning_rate;
}

namespace {

/// One training from its beginning, or from where it stopped, to its end.
class Training {
 public:
  Training(NetworkTrainer& trainer, const NetworkTraining& settings, const WindowSet& training,
           const WindowSet& validation, TrainingCheckpoint state, const FitContext& context)
      : trainer_(trainer),
        settings_(settings),
        training_(training),
        validation_(validation),
        context_(context),
        state_(std::move(state)),
        last_loss_(state_.best_loss),
        batches_((training.starts.size() + settings.batch - 1) / settings.batch) {}

  TrainedNetwork run() {
    std::string end;
    while (state_.epoch < settings_.epochs && end.empty()) {
      if (!run_epoch()) {
        end = fmt::format("the loss exploded in epoch {}", state_.epoch + 1);
      } else {
        end_epoch();
        if (settings_.patience > 0 && state_.epoch - state_.best_epoch >= settings_.patience &&
            state_.epoch < settings_.epochs)
          end = fmt::format("no better loss for {} epochs", settings_.patience);
      }
    }
    if (state_.best_epoch == 0)
      throw Error({.problem = end.empty() ? "no epoch had a finite loss" : end,
                   .advice = "Try a smaller learning_rate, a smaller clip, or look for outliers "
                             "with torsio check."});
    return {.weights = std::move(state_.best),
            .epochs = state_.epoch,
            .best_epoch = state_.best_epoch,
            .best_loss = state_.best_loss,
            .end = std::move(end)};
  }

 private:
  [[nodiscard]] std::vector<std::size_t> order() const {
    std::vector<std::size_t> windows = all_windows(training_);
    Random random(context_.seed * 0x9e3779b97f4a7c15U + state_.epoch + 1);
    for (std::size_t k = windows.size(); k-- > 1;)
      std::swap(windows[k], windows[random.below(k + 1)]);
    return windows;
  }

  void report(std::string_view doing) {
    if (!context_.progress) return;
    const double done = (static_cast<double>(state_.epoch) +
                         static_cast<double>(state_.batch) / static_cast<double>(batches_)) /
                        static_cast<double>(settings_.epochs);
    if (context_.progress(done, doing)) return;
    if (context_.keep) context_.keep(state_);
    throw Cancelled();
  }

  bool run_epoch() {
    const std::vector<std::size_t> windows = order();
    std::string doing = fmt::format("epoch {} of {}", state_.epoch + 1, settings_.epochs);
    if (state_.best_epoch > 0)
      doing += fmt::format(", loss {:.4g}, best {:.4g}", last_loss_, state_.best_loss);
    for (; state_.batch < batches_; ++state_.batch) {
      report(doing);
      const std::size_t begin = state_.batch * settings_.batch;
      const std::size_t size = std::min(settings_.batch, windows.size() - begin);
      const double rate = learning_rate_at(settings_, state_.updates, settings_.epochs * batches_);
      const double loss =
          trainer_.update(state_, training_, std::span(windows).subspan(begin, size), rate);
      if (!(loss < kExplodedLoss)) return false;  // or not a number
      state_.epoch_loss += loss;
    }
    return true;
  }

  void end_epoch() {
    const bool is_validated = !validation_.starts.empty();
    const double training_loss = state_.epoch_loss / static_cast<double>(batches_);
    const double loss = is_validated ? trainer_.loss(state_.weights, validation_) : training_loss;
    ++state_.epoch;
    if (context_.note_epoch)
      context_.note_epoch({.epoch = state_.epoch,
                           .training_error = std::sqrt(training_loss),
                           .held_out_error = is_validated ? std::sqrt(loss) : kNotMeasured});
    state_.batch = 0;
    state_.epoch_loss = 0.0;
    last_loss_ = loss;
    if (loss < (state_.best_epoch == 0 ? kExplodedLoss : state_.best_loss)) {  // false for NaN
      state_.best_loss = loss;
      state_.best_epoch = state_.epoch;
      state_.best = state_.weights;
    }
  }

  NetworkTrainer& trainer_;
  const NetworkTraining& settings_;
  const WindowSet& training_;
  const WindowSet& validation_;
  const FitContext& context_;
  TrainingCheckpoint state_;
  double last_loss_;  ///< after the last whole epoch
  std::size_t batches_;
};

TrainingCheckpoint first_state(std::vector<float> weights, const std::string& recipe) {
  TrainingCheckpoint state;
  state.recipe = recipe;
  state.mean.assign(weights.size(), 0.0F);
  state.square.assign(weights.size(), 0.0F);
  state.best = weights;
  state.weights = std::move(weights);
  return state;
}

std::vector<std::string> words_of(const std::string& recipe) {
  std::istringstream text(recipe);
  std::vector<std::string> words;
  for (std::string word; text >> word;) {
    if (word.ends_with(',')) word.pop_back();
    words.push_back(std::move(word));
  }
  return words;
}

/// What of "epochs 200 batch 64 ..." is another in `other`, as `recipe` has it; all of it where they
/// are not alike.
std::string differing_part(const std::string& recipe, const std::string& other) {
  const std::vector<std::string> own = words_of(recipe);
  const std::vector<std::string> others = words_of(other);
  if (own.size() != others.size() || own.empty() || own[0] != others[0]) return recipe;
  std::string part;
  for (std::size_t i = 1; i < own.size(); ++i) {
    const bool is_data = own[i - 1] == "data";  // last; other windows or seeds change it, too
    if (own[i] == others[i] || (is_data && !part.empty())) continue;
    part += part.empty() ? "" : ", ";
    const bool is_value = own[i - 1] == others[i - 1];
    part += is_data    ? "recordings of fingerprint " + own[i]
            : is_value ? own[i - 1] + " " + own[i]
                       : own[i];
  }
  return part;
}

TrainingCheckpoint resumed_state(const TrainingCheckpoint& from, std::size_t parameters,
                                 const std::string& recipe) {
  if (from.recipe != recipe)
    throw UsageError(
        {.place = "checkpoint",
         .expected = "one of this training: " + differing_part(recipe, from.recipe),
         .found = differing_part(from.recipe, recipe),
         .advice = "Resume with the recordings, settings and seed of the first call."});
  for (const std::vector<float>* values : {&from.weights, &from.mean, &from.square, &from.best})
    if (values->size() != parameters)
      throw Error({.place = "checkpoint",
                   .expected = fmt::format("{} numbers in each table", parameters),
                   .found = fmt::format("{}", values->size())});
  return from;
}

}  // namespace

TrainedNetwork train_network(NetworkTrainer& trainer, const NetworkTraining& settings,
                             const WindowSet& training, const WindowSet& validation,
                             std::vector<float> initial_weights, const std::string& recipe,
                             const FitContext& context) {
  TrainingCheckpoint state =
      context.resume == nullptr
          ? first_state(std::move(initial_weights), recipe)
          : resumed_state(*context.resume, trainer.network().parameter_count(), recipe);
  return Training(trainer, settings, training, validation, std::move(state), context).run();
}

}  // namespace torsio
