#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "fit/common/fitted.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"
#include "fit/gaussian_process/parametric_gp_trainer.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What the kernel's numbers descend on, while (m, S) is updated sample by sample; the noise always follows (17).
enum class KernelObjective : std::uint8_t {
  none,    ///< the kernel stays
  sample,  ///< ((y - mu)^2 + Sigma) / (2 sigma^2) + ln sigma^2 / 2, whose gradient is in (16)
  elbo,    ///< that + KL(N(m, S) | N(0, K)) / H
  nlml     ///< m . K^-1 m / 2 + ln det K / 2
};

/// How a number that a `Kernel` stores is the theta of paper 002, by which a plain step is taken.
enum class ThetaForm : std::uint8_t {
  logarithm,          ///< ln theta
  inverse_logarithm,  ///< -ln theta: the length scale of a linear kernel is 1 / theta_3
  offset,             ///< theta itself: the offset of a linear kernel, theta_4
  signed_logarithm    ///< ln |theta|; the sign changes the kernel: theta_8
};

/// One per number of the kernel, in the order of `Kernel::log_parameters`.
[[nodiscard]] std::vector<ThetaForm> theta_forms(const KernelExpression& kernel);

/// How the numbers move along their gradient.
enum class ThetaStep : std::uint8_t {
  adam,       ///< Kingma and Ba 2015, as they are stored
  logarithm,  ///< plain steps of ln theta, theta_4 included
  plain       ///< plain steps of theta
};

/// The least ln sigma^2 of data in their own units: a target of 1 mNm has a variance 1e-6 times that of 1 Nm.
inline constexpr double kLeastLogNoiseInUnits = kLeastLogNoise - 14.0;

struct GpDescentSettings {
  KernelObjective objective = KernelObjective::sample;
  ThetaStep step = ThetaStep::adam;
  double rate = 0.01;
  std::size_t updates = 20000;       ///< samples taken in, drawn by chance
  std::size_t batch = 1;             ///< samples between two steps of the kernel's numbers
  bool widens = false;               ///< S half way back to K every 1000 samples of the first 80 %
  bool has_printed_moments = false;  ///< `ParametricGpTrainer::take_in_as_printed`
  double lowest_log_noise = kLeastLogNoise;
};

struct GpDescent {
  ParametricGpTrainer trainer;
  std::size_t updates = 0;  ///< samples taken in
  std::string end = {};     ///< why it ended before the last one, in words; empty: it did not
};

/// @throws Cancelled
void descend(GpDescent& descent, const Table& table, const GpDescentSettings& settings,
             Random& random, const Progress& progress);

/// The samples that are learned, and those on which two models are compared.
struct GpSplit {
  Table training;
  Table evaluation;
  std::string tested_on;  ///< the latter, in words
};

/// The validation records for evaluation, or without these a fifth of the training samples in blocks.
[[nodiscard]] GpSplit split_for_refit(const TrainingData& data, const FitContext& context);

/// What a descent begins with.
struct GpStart {
  NetworkScaling scaling = {};
  Table table = {};     ///< the training samples, scaled
  Matrix centres = {};  ///< Z
  KernelExpression kernel = {};
  double noise_variance = 0.0;
  std::size_t wanted_points = 0;
  std::vector<std::string> notes = {};
};

/// Scaling, samples and centres; kernel and noise are the caller's.
/// @param is_standardised inputs and target to mean 0 and variance 1, else in their own units
[[nodiscard]] GpStart gp_start(const TrainingData& data, const Table& training,
                               bool is_standardised, std::size_t points, Random& random,
                               const Progress& progress);

struct LearnedGp {
  Fitted<ParametricGp> fitted;
  std::size_t updates = 0;  ///< samples taken in
};

/// The descent, and with `refit` the FITC posterior of the kernel that it found, in closed form over all samples,
/// if that has the smaller error.
/// @throws Error if the kernel has no matrix at the start, Cancelled
[[nodiscard]] LearnedGp learn(GpStart start, const GpSplit& split,
                              const GpDescentSettings& settings, bool refit, Random& random,
                              const FitContext& context);

}  // namespace torsio
