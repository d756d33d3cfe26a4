#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/narx/fit_narx.hpp"
#include "sensor_bench.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"

// Algorithm 1 of paper 002 as printed, each misprint, and each departure from it by itself.

namespace torsio {
namespace {

constexpr std::string_view kLags = "input_lags=7:output_lags=7:training=one_step";
constexpr std::size_t kMultisines = 8;
constexpr std::size_t kQuickMultisines = 2;
constexpr std::size_t kPoints = 14;  // M

struct Departure {
  const char* label;
  const char* options;  ///< as in `--models`
};

/// From the printed algorithm, one at a time, then one after the other.
constexpr std::array kDepartures{
    Departure{"Algorithm 1", ""},
    Departure{"theta plain", ":theta=plain"},
    Departure{"(20), (21) as printed", ":moments=printed"},
    Departure{"standardised", ":standardise=true"},
    Departure{"noise from 0.1 of the variance", ":first_noise=0.1"},
    Departure{"Adam", ":adam=true"},
    Departure{"(16) + KL / H", ":elbo=true"},
    Departure{"S widened", ":widen=true"},
    Departure{"closed form at the end", ":refit=true"},
    Departure{"standardised, noise 0.1", ":standardise=true:first_noise=0.1"},
    Departure{"standardised, noise 0.1, Adam", ":standardise=true:first_noise=0.1:adam=true"},
    Departure{"standardised, noise 0.1, Adam, KL / H",
              ":standardise=true:first_noise=0.1:adam=true:elbo=true"},
    Departure{"the same, S widened",
              ":standardise=true:first_noise=0.1:adam=true:elbo=true:widen=true"},
    Departure{"the same, S widened, closed form",
              ":standardise=true:first_noise=0.1:adam=true:elbo=true:widen=true:refit=true"}};

struct KernelCase {
  const char* condition;
  const char* options;
};
constexpr std::array kKernels{KernelCase{"combined kernel", ""},
                              KernelCase{"SE kernel", ":kernel=se"}};

/// (12) as printed, without exp: theta_5^2 (-2 / theta_6^2 sum sin^2), all theta at 0.3.
double printed_periodic(Features x, Features z) {
  constexpr double kTheta = 0.3;
  double sines = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
    sines += std::pow(std::sin(std::numbers::pi * (x[i] - z[i]) / kTheta), 2);
  return kTheta * kTheta * (-2.0 / (kTheta * kTheta) * sines);
}

/// (9) with (12) as printed, all theta at 0.3.
double printed_kernel(Features x, Features z) {
  constexpr double kTheta = 0.3;
  constexpr double kSquare = kTheta * kTheta;
  double square = 0.0;
  double line = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    square += (x[i] - z[i]) * (x[i] - z[i]);
    line += (x[i] - kTheta) * (z[i] - kTheta);
  }
  return kSquare * std::exp(-square / (2.0 * kSquare)) *
         (kSquare * line +
          printed_periodic(x, z) * std::pow(1.0 + square / (2.0 * kTheta * kSquare), -kTheta));
}

/// The least and the largest eigenvalue of K at the start, with (12) as printed.
std::pair<double, double> printed_eigenvalues(const SensorBench& bench, const ModelChoice& choice,
                                              std::uint64_t seed) {
  const TrainingData data = narx_data(learning_data(bench.dataset, choice.features).training,
                                      {.inputs = 7, .outputs = 7});
  Random random(seed);
  const Matrix centres = training_centres(usable_table(data), kPoints, random, {});
  const auto size = static_cast<Eigen::Index>(centres.rows);
  Eigen::MatrixXd k(size, size);
  for (std::size_t i = 0; i < centres.rows; ++i)
    for (std::size_t j = 0; j < centres.rows; ++j)
      k(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          printed_kernel(centres.row(i), centres.row(j));
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k).eigenvalues();
  return {values.minCoeff(), values.maxCoeff()};
}

/// How many of the samples were taken in.
std::string samples_text(const TrainedModel& trained, std::size_t updates) {
  const auto found = std::ranges::find(trained.table, kSamplesTakenIn, &FittedParameter::name);
  if (found == trained.table.end())
    throw Error({.place = "002-algorithm", .problem = "the fit does not report its samples"});
  return found->value < static_cast<double>(updates)
             ? fmt::format("breaks after {:.0f} of {} samples", found->value, updates)
             : fmt::format("takes in all {} samples", updates);
}

/// One training, and what it did. A kernel without a matrix at the start is a result, too.
std::optional<TrainedModel> try_training(const SensorBench& bench, const SensorCandidate& candidate,
                                         std::uint64_t seed, std::size_t updates, std::string& did,
                                         const Progress& progress) {
  const ModelChoice choice = choice_of(candidate, bench);
  try {
    TrainedModel trained = train_model(bench.dataset, choice, seed, progress);
    did = samples_text(trained, updates);
    return trained;
  } catch (const Cancelled&) {
    throw;
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    did = fmt::format("breaks after 0 samples ({})", error.report().problem);
    return std::nullopt;
  }
}

SensorBench bench_of(std::uint64_t seed, std::size_t multisines) {
  SensorBench bench = trained_on_grid(seed);
  for (std::size_t i = 0; i < multisines; ++i) {
    const Recording recording = sensor_recording("multisine", seed + kFirstTestSeed + i);
    bench.add_test(recording, "multisine", kSensorWarmUp, recording.size());
  }
  return bench;
}

/// (12) as printed makes no covariance.
std::string eigenvalue_text(const SensorBench& bench, std::uint64_t seed) {
  const auto [least, largest] =
      printed_eigenvalues(bench, choice_of({.label = {}, .model = "arx"}, bench), seed);
  return fmt::format(
      "(12) as printed, without exp: the eigenvalues of K at the start lie between {:.3g} and "
      "{:.3g}, so that K "
      "is {} a covariance",
      least, largest, least < 0.0 ? "not" : "still");
}

}  // namespace

Study algorithm_002(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "Algorithm 1 of paper 002 as printed, but for its misprints, as a NARX model with 7 "
          "past torques and 8 twists in Nm and rad, M = 14, trained one step ahead on the grid "
          "of sines with 200 000 samples drawn by chance; its misprints and each departure "
          "from it; tested in free run on other multisines from rest, scored after 4 s",
      .unit = "Nm",
      .options = options,
      .plants = {study_plant(kSensorActuator)}};
  const std::size_t updates = options.is_quick ? 1000 : 200'000;
  StudyRows rows;
  std::vector<std::string> notes;
  const std::size_t fits = options.repeats * kKernels.size() * kDepartures.size();
  std::size_t done = 0;
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    const SensorBench bench = bench_of(seed, options.is_quick ? kQuickMultisines : kMultisines);
    if (k == 0) study.notes.push_back(eigenvalue_text(bench, seed));
    for (const KernelCase& kernel : kKernels)
      for (const Departure& departure : kDepartures) {
        const SensorCandidate candidate{
            .label = departure.label,
            .model = fmt::format("narx_parametric_gp_paper:{}:updates={}{}{}", kLags, updates,
                                 kernel.options, departure.options)};
        std::string did;
        if (const auto trained = try_training(bench, candidate, seed, updates, did,
                                              nth_of(progress, done++, fits, candidate.label)))
          rows.add(
              evaluate_model(trained->file, bench.dataset), bench.dataset, Role::test,
              [&](const std::string&) { return std::string(kernel.condition); },
              [&](const ResultRow&) { return candidate.label; });
        notes.push_back(
            fmt::format("seed {}, {}, {}: {}", seed, kernel.condition, candidate.label, did));
      }
  }
  study.table = ErrorTable{.rows = rows.errors(), .full_scale = kSensorFullScale_Nm};
  study.notes.insert(study.notes.end(), notes.begin(), notes.end());
  return study;
}

}  // namespace torsio
