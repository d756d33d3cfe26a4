#include "fit/network/fit_network.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "fit/common/fitted.hpp"
#include "network_example.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

// Sum of sines; the target is the input `delay` samples ago. No single sample determines it.
TrainingData delayed_sines(std::size_t records, std::size_t samples, std::size_t delay) {
  Random random(17);
  TrainingData data;
  data.inputs = {{.expression = "x"}};
  data.target = "torque_Nm";
  data.sample_rate_Hz = 100.0;
  for (std::size_t r = 0; r < records; ++r) {
    const double phase = 2.0 * std::numbers::pi * random.uniform();
    const auto signal = [&](double n) {
      return std::sin(0.21 * n + phase) + 0.7 * std::sin(0.13 * n + 2.0 * phase) +
             0.5 * std::sin(0.33 * n + 3.0 * phase);
    };
    Sequence sequence{.recording = "sines" + std::to_string(r), .features = Matrix(samples, 1)};
    for (std::size_t n = 0; n < samples; ++n) {
      sequence.features(n, 0) = signal(static_cast<double>(n));
      sequence.target.push_back(3.0 +
                                2.0 * signal(static_cast<double>(n) - static_cast<double>(delay)));
    }
    sequence.use.assign(samples, 1);
    data.sequences.push_back(std::move(sequence));
  }
  return data;
}

// A step that is too long throws the weights to where every unit is off; the training then ends at once.
TEST(FitMlp, TrainsAgainWhereItEndedAboveALinearModelAndReportsIt) {
  const TrainingData data = delayed_sines(5, 300, 0);  // the target is linear in the input
  MlpOptions options{.layers = {3}, .training = {.epochs = 20, .batch = 8, .learning_rate = 3.0}};
  options.training.patience = 1;
  const auto fitted = fit_mlp(data, options);
  const auto has_note = [&](const std::string& part) {
    return std::ranges::any_of(fitted.notes, [&](const std::string& note) {
      return note.find(part) != std::string::npos;
    });
  };
  EXPECT_TRUE(has_note("trained from 3 starts"));
  EXPECT_TRUE(
      has_note("warning: on its own training data the network is worse than a linear model"));
  options.training = {.epochs = 200, .batch = 8, .learning_rate = 1e-2};
  options.activation = Activation::linear;
  for (const std::string& note : fit_mlp(data, options).notes)
    EXPECT_EQ(note.find("linear model"), std::string::npos) << note;
}

RecurrentOptions small_memory() {
  return {.layers = {8},
          .windows = {.length = 30, .stride = 10, .burn_in = 10},
          .training = {.epochs = 3, .batch = 16, .learning_rate = 5e-3}};
}

template <class Model>
double free_run_rmse(Model model, const TrainingData& data, std::size_t settle) {
  double square = 0.0;
  std::size_t count = 0;
  for (const Sequence& sequence : data.sequences) {
    model.reset();
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      const double error = model.step(sequence.features.row(n)).value - sequence.target[n];
      if (n < settle) continue;
      square += error * error;
      ++count;
    }
  }
  return std::sqrt(square / static_cast<double>(count));
}

double spread(const TrainingData& data) {
  double sum = 0.0;
  double square = 0.0;
  double count = 0.0;
  for (const Sequence& sequence : data.sequences)
    for (const double value : sequence.target) {
      sum += value;
      square += value * value;
      count += 1.0;
    }
  return std::sqrt(square / count - sum * sum / (count * count));
}

TEST(FitNetwork, AnLstmFitsAMemoryThatAStaticNetworkCannot) {
  const TrainingData data = delayed_sines(5, 1500, 8);
  TrainingData test = delayed_sines(6, 600, 8);
  test.sequences.erase(test.sequences.begin(), test.sequences.begin() + 5);  // a phase of its own
  const RecurrentOptions options{.layers = {16},
                                 .windows = {.length = 60, .stride = 15, .burn_in = 15},
                                 .training = {.epochs = 40, .batch = 16, .learning_rate = 1e-2}};
  const double scale = spread(test);
  const double lstm = free_run_rmse(Lstm(fit_lstm(data, options).parameters), test, 60);
  const double gru = free_run_rmse(Gru(fit_gru(data, options).parameters), test, 60);
  const double mlp =
      free_run_rmse(Mlp(fit_mlp(data, {.training = {.epochs = 10}}).parameters), test, 60);
  EXPECT_LT(lstm, 0.15 * scale);
  EXPECT_LT(gru, 0.15 * scale);
  EXPECT_GT(mlp, 0.7 * scale);
}

TEST(FitNetwork, AnMlpLearnsFrictionThatALineCannot) {
  const TrainingData data = test::noisy_spring(8000);
  const Fitted<Mlp> fitted = fit_mlp(data, {.training = {.epochs = 40, .batch = 64, .clip = 0.0}});
  EXPECT_LT(free_run_rmse(Mlp(fitted.parameters), data, 0), 0.8);  // a line: 2.5 Nm
}

TEST(FitNetwork, GivesTheSameBitsWhateverTheNumberOfThreads) {
  const TrainingData data = delayed_sines(3, 400, 3);
  RecurrentOptions options = small_memory();
  options.training.batch = 40;
  options.training.threads = 1;
  const auto one = fit_lstm(data, options, {.seed = 4}).parameters;
  for (const std::size_t threads : {2U, 3U, 8U}) {
    options.training.threads = threads;
    EXPECT_EQ(fit_lstm(data, options, {.seed = 4}).parameters, one) << threads;
  }
  EXPECT_NE(fit_lstm(data, options, {.seed = 5}).parameters, one);
}

TEST(FitNetwork, AnEnsembleBeginsWithTheSingleNetworkAndItsMembersDiffer) {
  const TrainingData data = test::noisy_spring(3000);
  const MlpOptions options{.layers = {8}, .training = {.epochs = 5, .batch = 64, .clip = 0.0}};
  const auto ensemble = fit_mlp_ensemble(data, options, 3, {.seed = 4});
  ASSERT_EQ(ensemble.parameters.members.size(), 3U);
  EXPECT_EQ(ensemble.parameters.members[0], fit_mlp(data, options, {.seed = 4}).parameters);
  EXPECT_NE(ensemble.parameters.members[1].layers, ensemble.parameters.members[2].layers);
  EXPECT_THROW((void)fit_mlp_ensemble(data, options, 1), UsageError);
}

TEST(FitNetwork, AnEnsembleDoubtsMoreFarFromItsData) {
  const TrainingData data = test::noisy_spring(3000);
  MlpEnsemble ensemble(
      fit_mlp_ensemble(data, {.layers = {16}, .training = {.epochs = 20, .batch = 64}}, 4)
          .parameters);
  std::vector<double> features(data.input_count(), 0.0);
  const double near = ensemble.step(features).std_dev;
  for (std::size_t j = 0; j < features.size(); ++j)
    features[j] = 20.0 * ensemble.parameters().members[0].scaling.inputs.scale[j];
  EXPECT_GT(ensemble.step(features).std_dev, 1.5 * near);
}

TEST(FitNetwork, AResumedEnsembleIsBitForBitWhatItWouldHaveBeen) {
  const TrainingData data = delayed_sines(3, 400, 3);
  const auto gru = [&](const FitContext& context) {
    return fit_gru_ensemble(data, small_memory(), 3, context);
  };
  int calls = 0;
  const auto whole = gru({.seed = 6, .progress = [&](double, std::string_view) {
                            ++calls;
                            return true;
                          }});
  for (const int stop : {2, calls / 2, calls - 1}) {
    TrainingCheckpoint kept;
    int left = stop;
    EXPECT_THROW((void)gru({.seed = 6,
                            .progress = [&](double, std::string_view) { return --left > 0; },
                            .keep = [&](const TrainingCheckpoint& state) { kept = state; }}),
                 Cancelled);
    ASSERT_FALSE(kept.recipe.empty()) << stop;
    const TemporaryFolder folder;
    save_checkpoint(folder.path("c"), kept);
    kept = load_checkpoint(folder.path("c"));
    EXPECT_EQ(gru({.seed = 6, .resume = &kept}).parameters, whole.parameters) << stop;
    if (stop == calls - 1) {
      EXPECT_EQ(kept.finished_loss.size(), 2U);
      kept.finished.pop_back();
      EXPECT_THROW((void)gru({.seed = 6, .resume = &kept}), Error);
    }
    EXPECT_THROW((void)gru({.seed = 7, .resume = &kept}), Error);
  }
}

TEST(FitNetwork, KeepsTheWeightsOfTheBestEpochAndStopsWithoutABetterOne) {
  // Noise: what is learned by heart makes the held-out loss worse.
  Random random(3);
  TrainingData data =
      test::training_data_of({{.expression = "a"}, {.expression = "b"}}, Matrix(120, 2),
                             [&](std::span<const double>) { return random.normal(); });
  for (double& value : data.sequences[0].features.values) value = random.normal();
  data.sequences.push_back(data.sequences[0]);
  for (double& value : data.sequences[1].target) value = random.normal();
  const TrainingData validation = [&] {
    TrainingData other = data;
    other.sequences.erase(other.sequences.begin());
    return other;
  }();
  data.sequences.pop_back();

  MlpOptions options{.layers = {40, 40}};
  options.training = {.epochs = 200, .batch = 16, .learning_rate = 5e-3, .patience = 4};
  const Fitted<Mlp> stopped = fit_mlp(data, options, {.seed = 1, .validation = &validation});
  EXPECT_THAT(stopped.notes, testing::Contains(HasSubstr("no better loss for 4 epochs")));
  options.training.patience = 0;
  const Fitted<Mlp> all = fit_mlp(data, options, {.seed = 1, .validation = &validation});
  EXPECT_LE(free_run_rmse(Mlp(all.parameters), validation, 0),
            free_run_rmse(Mlp(stopped.parameters), validation, 0) * (1.0 + 1e-6));
  // The same course, cut where the best epoch was, ends with the same weights.
  std::size_t best = 0;
  ASSERT_EQ(std::sscanf(stopped.notes.front().c_str(), "weights of epoch %zu", &best), 1);
  EXPECT_LT(best, 100U);
  options.training.epochs = best;
  EXPECT_EQ(fit_mlp(data, options, {.seed = 1, .validation = &validation}).parameters,
            stopped.parameters);
}

/// Stops a fit at the `calls`-th report and keeps its checkpoint.
template <class Fit>
TrainingCheckpoint stopped_at(std::size_t calls, const Fit& fit) {
  TrainingCheckpoint kept;
  std::size_t reports = 0;
  FitContext context{.seed = 6};
  context.progress = [&](double, std::string_view) { return ++reports < calls; };
  context.keep = [&](const TrainingCheckpoint& checkpoint) { kept = checkpoint; };
  EXPECT_THROW((void)fit(context), Cancelled);
  return kept;
}

/// Batches per epoch for a single record whose last fifth is held out after an embargo of a
/// hundredth.
std::size_t batches_an_epoch(const TrainingData& data, std::size_t batch) {
  const std::size_t samples = data.sequences.front().target.size();
  const std::size_t learned = samples - samples / 5 - samples / 100;
  return (learned + batch - 1) / batch;
}

TEST(FitNetwork, ResumedIsBitForBitWhatItWouldHaveBeen) {
  const TrainingData data = delayed_sines(4, 500, 3);
  for (const Optimiser optimiser : {Optimiser::adam, Optimiser::adamw}) {
    RecurrentOptions options = small_memory();
    options.training.optimiser = optimiser;
    options.training.weight_decay = 1e-3;
    options.training.schedule = RateSchedule::cosine;
    const auto lstm = [&](const FitContext& context) { return fit_lstm(data, options, context); };
    const auto whole = lstm({.seed = 6}).parameters;
    for (const std::size_t calls : {2U, 7U, 20U}) {
      const TrainingCheckpoint kept = stopped_at(calls, lstm);
      EXPECT_FALSE(kept.weights.empty());
      EXPECT_EQ(lstm({.seed = 6, .resume = &kept}).parameters, whole) << calls;
    }
  }
}

TEST(FitNetwork, RefusesACheckpointOfAnotherTraining) {
  const TrainingData data = delayed_sines(4, 500, 3);
  RecurrentOptions options = small_memory();
  const auto lstm = [&](const FitContext& context) { return fit_lstm(data, options, context); };
  const TrainingCheckpoint kept = stopped_at(5, lstm);
  EXPECT_THROW((void)lstm({.seed = 7, .resume = &kept}), UsageError);
  const std::string message =
      test::error_message([&] { (void)lstm({.seed = 7, .resume = &kept}); });
  EXPECT_THAT(message, testing::HasSubstr("expected one of this training: seed 7, found seed 6"))
      << "only what differs is named";
  options.layers = {9};
  EXPECT_THROW((void)lstm({.seed = 6, .resume = &kept}), UsageError);
}

TEST(FitNetwork, WindowsNeitherLeaveARecordNorCrossAGapInItsInputs) {
  TrainingData data = delayed_sines(2, 100, 3);
  data.sequences[0].features(55, 0) = std::numeric_limits<double>::quiet_NaN();
  data.sequences[0].use[55] = 0;
  const auto parts = whole_sequences(data);
  const TrainingWindows windows{.length = 30, .stride = 10, .burn_in = 5};
  const WindowSet set = make_windows(data, parts, scaling_of(data, parts), windows);
  // 55 samples: 0 10 20 25; 44 from 56 on: 56 66 70; the whole second record: 0 10 .. 70
  const std::vector<std::size_t> expected{0,   10,  20,  25,  56,  66,  70, 100,
                                          110, 120, 130, 140, 150, 160, 170};
  EXPECT_EQ(set.starts, expected);
}

TEST(FitNetwork, LeavesOutWindowsWithoutTargets) {
  TrainingData data = delayed_sines(1, 100, 3);
  for (std::size_t n = 0; n < 60; ++n) data.sequences[0].use[n] = 0;
  const auto parts = whole_sequences(data);
  const TrainingWindows windows{.length = 30, .stride = 30, .burn_in = 5};
  const WindowSet set = make_windows(data, parts, scaling_of(data, parts), windows);
  EXPECT_EQ(set.starts, (std::vector<std::size_t>{60, 70}));
}

TEST(FitNetwork, KeepsOfSingleSamplesOnlyThoseToLearnFrom) {
  TrainingData data = delayed_sines(2, 100, 3);
  for (Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < 100; ++n) sequence.use[n] = n % 8 == 3 ? 1 : 0;
  const auto parts = whole_sequences(data);
  const NetworkScaling scaling = scaling_of(data, parts);
  const WindowSet set =
      make_windows(data, parts, scaling, {.length = 1, .stride = 1, .burn_in = 0});
  ASSERT_EQ(set.starts.size(), 26U);
  EXPECT_EQ(set.use, std::vector<std::uint8_t>(26, 1));
  EXPECT_EQ(set.targets.size(), 26U);
  ASSERT_EQ(set.features.size(), 26U * data.input_count());
  const double input = data.sequences[1].features(11, 0);
  EXPECT_EQ(set.features[set.starts[14] * data.input_count()],
            static_cast<float>((input - scaling.inputs.centre[0]) / scaling.inputs.scale[0]))
      << "the second sample in use of the second record";
}

TEST(FitNetwork, HoldsOutWholeRecordsOrTheEndOfTheOnlyOne) {
  const TrainingData many = delayed_sines(10, 100, 3);
  const TrainingWindows windows{.length = 20, .stride = 20, .burn_in = 5};
  const TrainingSplit by_record = split_for_validation(many, windows, 20, 1);
  EXPECT_EQ(by_record.training.size(), 8U);
  ASSERT_EQ(by_record.validation.size(), 2U);
  EXPECT_EQ(by_record.validation[0].end, 100U);

  const TrainingSplit of_one = split_for_validation(delayed_sines(1, 500, 3), windows, 20, 1);
  ASSERT_EQ(of_one.training.size(), 1U);
  EXPECT_EQ(of_one.training[0].end, 380U);
  EXPECT_EQ(of_one.validation.at(0).begin, 400U);
}

TEST(FitNetwork, RefusesDataThatItCannotLearnFrom) {
  EXPECT_THAT(test::error_message([] { (void)fit_lstm(delayed_sines(3, 25, 2), small_memory()); }),
              testing::AllOf(HasSubstr("30 samples"), HasSubstr("longest record has 25")));
  TrainingData constant = delayed_sines(2, 100, 2);
  for (Sequence& sequence : constant.sequences) sequence.target.assign(100, 1.5);
  EXPECT_THAT(test::error_message([&] { (void)fit_mlp(constant, {}); }),
              HasSubstr("a target that changes"));
  TrainingData gap = delayed_sines(2, 100, 2);
  gap.sequences[0].target[40] = gap.sequences[1].target[40] = std::nan("");
  EXPECT_THAT(test::error_message([&] { (void)fit_gru(gap, small_memory()); }),
              HasSubstr("sample 40"));
}

TEST(FitNetwork, RefusesANetworkThatFitsNoFileOrMemory) {
  const TrainingData data = delayed_sines(2, 100, 2);
  EXPECT_THAT(test::error_message([&] {
                (void)fit_mlp(data, {.layers = {60000, 60000}});
              }),
              HasSubstr("MiB"));
  // One member would fit, so would four.
  EXPECT_THAT(test::error_message([&] {
                (void)fit_mlp_ensemble(data, {.layers = {3000, 3000}}, 64, {});
              }),
              AllOf(HasSubstr("in each of 64 members"), HasSubstr("Take fewer members")));
  // Every 16 windows of a batch have a gradient of their own: here more than a terabyte of them.
  RecurrentOptions options = small_memory();
  options.layers = {3900};
  options.windows.stride = 1;
  options.training.batch = 1'000'000;
  EXPECT_THAT(test::error_message([&] { (void)fit_lstm(delayed_sines(3, 40'000, 2), options); }),
              HasSubstr("memory"));
}

TEST(FitNetwork, RefusesOptionsOutOfRange) {
  const TrainingData data = delayed_sines(2, 100, 2);
  const auto refused = [&](auto change) {
    RecurrentOptions options = small_memory();
    change(options);
    EXPECT_THROW((void)fit_lstm(data, options), UsageError);
  };
  refused([](RecurrentOptions& o) { o.layers = {}; });
  refused([](RecurrentOptions& o) { o.layers = {0}; });
  refused([](RecurrentOptions& o) { o.layers.assign(100, 2); });
  refused([](RecurrentOptions& o) { o.windows.burn_in = o.windows.length; });
  refused([](RecurrentOptions& o) { o.windows.stride = 0; });
  refused([](RecurrentOptions& o) { o.training.batch = 0; });
  refused([](RecurrentOptions& o) { o.training.epochs = 0; });
  refused([](RecurrentOptions& o) { o.training.learning_rate = -1.0; });
  refused([](RecurrentOptions& o) { o.training.clip = std::nan(""); });
}

TEST(FitNetwork, AnExplodingLossKeepsTheBestOrIsReported) {
  const TrainingData data = test::noisy_spring();
  MlpOptions options{.activation = Activation::linear};
  options.training = {.epochs = 30, .learning_rate = 1e30, .clip = 0.0, .patience = 0};
  EXPECT_THAT(test::error_message([&] { (void)fit_mlp(data, options); }),
              HasSubstr("the loss exploded in epoch 1"));

  // Later, there is a best: weights so large that the next step overflows.
  options.training = {.epochs = 30, .learning_rate = 1e-3, .patience = 0};
  const auto mlp = [&](const FitContext& context) { return fit_mlp(data, options, context); };
  const std::size_t after_two_epochs = 2 + 2 * batches_an_epoch(data, options.training.batch);
  TrainingCheckpoint kept = stopped_at(after_two_epochs, mlp);
  ASSERT_EQ(kept.epoch, 2U);
  kept.weights.assign(kept.weights.size(), 1e30F);
  const Fitted<Mlp> fitted = mlp({.seed = 6, .resume = &kept});
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("the loss exploded in epoch 3")));
  EXPECT_LT(free_run_rmse(Mlp(fitted.parameters), data, 0), spread(data));
}

TEST(FitNetwork, SequenceToOneLearnsFromTheLastSampleOfAWindow) {
  const TrainingData data = delayed_sines(3, 800, 3);
  RecurrentOptions options = small_memory();
  options.windows = {.length = 20, .stride = 2, .burn_in = 0, .last_only = true};
  options.training.epochs = 8;
  const double rmse = free_run_rmse(Gru(fit_gru(data, options).parameters), data, 60);
  EXPECT_LT(rmse, 0.4 * spread(data));
}

}  // namespace
}  // namespace torsio
