#include "torsio/train/fit_narx.hpp"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/not_measured.hpp"
#include "torsio/core/random.hpp"
#include "torsio/train/fit_linear.hpp"
#include "torsio/train/metrics.hpp"

namespace torsio {
namespace {

using Rest = Narx<Linear>::Parameters;
using Lists = std::vector<std::vector<double>>;  // one a sequence

constexpr std::size_t kCorrected = 50;  // measured samples that a simulation starts from

void check(const NarxLags& lags) {
  constexpr std::size_t kMost = Narx<Linear>::kMostLags;
  if (lags.outputs >= 1 && lags.outputs <= kMost && lags.inputs <= kMost) return;
  throw UsageError({.place = "lags",
                    .expected = fmt::format("0 to {0} of inputs, 1 to {0} of outputs", kMost),
                    .found = fmt::format("{} and {}", lags.inputs, lags.outputs)});
}

struct Spread {
  double deviation = 0.0;
  double largest = 0.0;  ///< magnitude
};

Spread spread_of(const TrainingData& data) {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;
  Spread spread;
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const double distance = sequence.target[n] - mean;
      mean += distance / ++count;
      squares += distance * (sequence.target[n] - mean);
      spread.largest = std::max(spread.largest, std::abs(sequence.target[n]));
    }
  }
  spread.deviation = std::sqrt(squares / std::max(count, 1.0));
  return spread;
}

/// Everything of a NARX model but f.
Rest rest_of(const TrainingData& data, const NarxLags& lags, double range, const Spread& spread) {
  if (!(spread.deviation > 0.0))
    throw Error({.place = data.target, .expected = "a target that changes", .found = "a constant"});
  return {.model = {},
          .inputs = data.input_count(),
          .input_lags = lags.inputs,
          .output_lags = lags.outputs,
          .sample_period_s = 1.0 / data.sample_rate_Hz,
          .lowest = -range * spread.largest,
          .highest = range * spread.largest,
          .start = 0.0};
}

/// The outputs of a free run from the first measured samples.
std::vector<double> simulated(AnyModel& model, const Sequence& sequence) {
  std::vector<double> outputs(sequence.target.size(), kNotMeasured);
  model.reset();
  std::size_t corrected = 0;
  for (std::size_t n = 0; n < outputs.size(); ++n) {
    if (sequence.has_features(n)) outputs[n] = model.step(sequence.features.row(n)).value;
    if (corrected == kCorrected || !std::isfinite(sequence.target[n])) continue;
    model.correct(sequence.target[n]);
    outputs[n] = sequence.target[n];
    ++corrected;
  }
  return outputs;
}

Lists simulated(AnyModel& model, const TrainingData& data) {
  Lists outputs;
  for (const Sequence& sequence : data.sequences) outputs.push_back(simulated(model, sequence));
  return outputs;
}

/// Over what came behind the measured start.
double free_run_rmse(const Lists& outputs, const TrainingData& data) {
  MetricsAccumulator accumulator;
  for (std::size_t s = 0; s < outputs.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    std::size_t told = 0;
    for (std::size_t n = 0; n < outputs[s].size(); ++n) {
      if (told == kCorrected) {
        if (sequence.use[n] != 0) accumulator.add(outputs[s][n], sequence.target[n]);
      } else if (std::isfinite(sequence.target[n])) {
        ++told;
      }
    }
  }
  return accumulator.metrics().rmse;
}

Lists noisy_targets(const TrainingData& data, double deviation, std::uint64_t seed) {
  Random random(seed);
  Lists outputs;
  for (const Sequence& sequence : data.sequences) {
    outputs.push_back(sequence.target);
    for (double& value : outputs.back()) value += deviation * random.normal();
  }
  return outputs;
}

void require_usable(const TrainingData& data, const NarxLags& lags) {
  if (data.usable_samples() > 0) return;
  throw Error(
      {.place = "training records",
       .expected = fmt::format("a stretch of measured {} longer than the lags of {} samples",
                               data.target, std::max(lags.inputs, lags.outputs)),
       .found = "none",
       .advice = "Take fewer lags, or give longer records."});
}

}  // namespace

TrainingData narx_data(const TrainingData& data, const NarxLags& lags, const Lists* outputs) {
  check(lags);
  TrainingData result{
      .inputs = {}, .target = data.target, .sample_rate_Hz = data.sample_rate_Hz, .sequences = {}};
  const auto lagged = [](const std::string& name, std::size_t lag) {
    return lag == 0 ? name : fmt::format("lag({}, {})", name, lag);
  };
  for (std::size_t lag = 0; lag <= lags.inputs; ++lag)
    for (const InputInfo& input : data.inputs)
      result.inputs.push_back({lagged(input.expression, lag), input.is_rate});
  for (std::size_t lag = 1; lag <= lags.outputs; ++lag)
    result.inputs.push_back({lagged(data.target, lag), false});

  const std::size_t most = std::max(lags.inputs, lags.outputs);
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& from = data.sequences[s];
    const std::vector<double>& past = outputs == nullptr ? from.target : (*outputs)[s];
    Sequence to{.recording = from.recording,
                .features = Matrix(from.target.size(), result.inputs.size()),
                .target = from.target,
                .use = from.use};
    for (std::size_t n = 0; n < from.target.size(); ++n) {
      if (n < most) {
        to.use[n] = 0;
        continue;
      }
      auto at = to.features.row(n).begin();
      for (std::size_t lag = 0; lag <= lags.inputs; ++lag)
        at = std::ranges::copy(from.features.row(n - lag), at).out;
      for (std::size_t lag = 1; lag <= lags.outputs; ++lag) *at++ = past[n - lag];
      if (!to.has_features(n)) to.use[n] = 0;
    }
    result.sequences.push_back(std::move(to));
  }
  require_usable(result, lags);
  return result;
}

FittedModel fit_narx(const TrainingData& data, const NarxOptions& options, const NarxInner& inner,
                     const FitContext& context) {
  const Spread spread = spread_of(data);
  const Rest rest = rest_of(data, options.lags, options.range, spread);
  const std::size_t rounds = options.training == NarxTraining::free_run ? options.rounds : 0;
  const TrainingData& judge = context.validation == nullptr ? data : *context.validation;
  std::optional<TrainingData> validation;
  if (context.validation != nullptr) validation = narx_data(*context.validation, options.lags);

  Lists outputs;
  if (options.training == NarxTraining::noise)
    outputs = noisy_targets(data, options.noise * spread.deviation, context.seed);
  std::optional<FittedModel> best;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best_round = 0;
  for (std::size_t round = 0; round <= rounds; ++round) {
    FitContext own{
        .seed = context.seed, .progress = {}, .validation = validation ? &*validation : nullptr};
    if (context.progress) {
      own.progress = [&](double share, std::string_view doing) {
        return context.progress(
            (static_cast<double>(round) + share) / static_cast<double>(rounds + 1), doing);
      };
    }
    FittedModel f =
        inner.fit(narx_data(data, options.lags, outputs.empty() ? nullptr : &outputs), own);
    AnyModel model = inner.wrap(f.model, rest);
    const double rmse = free_run_rmse(simulated(model, judge), judge);
    if (!best || rmse < least || !std::isfinite(least)) {
      least = rmse;
      best_round = round;
      best = FittedModel{model, std::move(f.notes)};
    }
    if (round < rounds) outputs = simulated(model, data);
  }
  best->notes.push_back(
      fmt::format("free run on {}: RMSE {:.4g} in the target's unit{}",
                  context.validation == nullptr ? "the training records" : "the validation records",
                  least, rounds == 0 ? "" : fmt::format(" (round {} of {})", best_round, rounds)));
  return *std::move(best);
}

namespace {

/// The error of an ARX model's free run over one sequence, from the measured start.
class FreeRunError : public ceres::CostFunction {
 public:
  FreeRunError(const Sequence& sequence, const TrainingData& regressors, std::size_t index,
               const NarxLags& lags)
      : sequence_(sequence),
        rows_(regressors.sequences[index]),
        lags_(lags),
        columns_(regressors.input_count() + 1) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(columns_));
    set_num_residuals(static_cast<int>(sequence_.target.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* theta = parameters[0];
    double* jacobian = jacobians == nullptr ? nullptr : jacobians[0];
    const std::size_t outputs = lags_.outputs;
    const std::size_t first_output = columns_ - outputs;
    const std::size_t samples = sequence_.target.size();
    const std::size_t start = std::max({lags_.inputs, outputs, kCorrected});
    std::vector<double> past(samples, 0.0);
    std::vector<double> slopes(jacobian == nullptr ? 0 : samples * columns_, 0.0);
    std::vector<double> regressor(columns_, 1.0);
    std::fill_n(residuals, samples, 0.0);
    if (jacobian != nullptr) std::fill_n(jacobian, samples * columns_, 0.0);
    for (std::size_t n = 0; n < samples; ++n) {
      const auto inputs = rows_.features.row(n).first(first_output - 1);
      if (n < start || !std::ranges::all_of(inputs, [](double x) { return std::isfinite(x); })) {
        const double measured = sequence_.target[n];
        if (std::isfinite(measured))
          past[n] = measured;
        else if (n > 0)
          past[n] = past[n - 1];
        continue;
      }
      std::ranges::copy(inputs, regressor.begin() + 1);
      for (std::size_t i = 0; i < outputs; ++i) regressor[first_output + i] = past[n - 1 - i];
      double value = 0.0;
      for (std::size_t j = 0; j < columns_; ++j) value += theta[j] * regressor[j];
      if (!(std::abs(value) < kLargest)) return false;  // this step of the search runs away
      past[n] = value;
      const bool is_judged = sequence_.use[n] != 0;
      if (is_judged) residuals[n] = value - sequence_.target[n];
      if (jacobian == nullptr) continue;
      double* slope = slopes.data() + n * columns_;
      for (std::size_t j = 0; j < columns_; ++j) slope[j] = regressor[j];
      for (std::size_t i = 0; i < outputs; ++i) {
        const double* before = slopes.data() + (n - 1 - i) * columns_;
        for (std::size_t j = 0; j < columns_; ++j) slope[j] += theta[first_output + i] * before[j];
      }
      if (is_judged) std::copy_n(slope, columns_, jacobian + n * columns_);
    }
    return true;
  }

 private:
  static constexpr double kLargest = 1e12;
  const Sequence& sequence_;
  const Sequence& rows_;
  NarxLags lags_;
  std::size_t columns_;
};

/// Simulation-error refinement of b, k_1 .. k_n.
std::vector<double> refined(std::vector<double> theta, const TrainingData& data,
                            const TrainingData& regressors, const NarxLags& lags,
                            std::string& report) {
  ceres::Problem problem;
  for (std::size_t s = 0; s < data.sequences.size(); ++s)
    problem.AddResidualBlock(
        new FreeRunError(data.sequences[s], regressors, s, lags),  // the problem owns it
        nullptr, theta.data());
  ceres::Solver::Options settings;
  settings.linear_solver_type = ceres::DENSE_QR;
  settings.max_num_iterations = 100;
  settings.num_threads = 1;
  settings.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  // What the search meets is in the summary; Ceres would also tell the terminal.
  FLAGS_minloglevel = google::GLOG_FATAL;
  ceres::Solve(settings, &problem, &summary);
  report = fmt::format("output error {} after {} iterations",
                       summary.termination_type == ceres::CONVERGENCE ? "converged" : "stopped",
                       summary.iterations.size());
  return theta;
}

}  // namespace

Fitted<Narx<Linear>> fit_arx(const TrainingData& data, const ArxOptions& options,
                             const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting arx");
  const TrainingData regressors = narx_data(data, options.lags);
  Fitted<Linear> f = fit_linear(regressors, {.rates = true});
  Rest parameters = rest_of(data, options.lags, options.range, spread_of(data));
  parameters.model = f.parameters;
  if (!options.is_refined) return {parameters, std::move(f.notes)};

  const auto rmse_of = [&](const Rest& of) {
    AnyModel model{Narx<Linear>(of)};
    return free_run_rmse(simulated(model, data), data);
  };
  report_progress(context.progress, 0.3, "refining arx");
  std::string report;
  Rest better = parameters;
  better.model.coefficients.values.values =
      refined(parameters.model.coefficients.values.values, data, regressors, options.lags, report);
  const double before = rmse_of(parameters);
  const double after = rmse_of(better);
  f.notes.push_back(
      fmt::format("free run on the training records: RMSE {:.4g} as fitted one step ahead, {:.4g} "
                  "refined; {}{}",
                  before, after, report, after < before ? "" : ": kept as it was"));
  return {after < before ? better : parameters, std::move(f.notes)};
}

}  // namespace torsio
