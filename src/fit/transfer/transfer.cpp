#include "torsio/fit/transfer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "actuator/second_stage.hpp"
#include "core/report_progress.hpp"
#include "fit/common/guards.hpp"
#include "fit/common/model_run.hpp"
#include "fit/common/reference_check.hpp"
#include "fit/common/training_rules.hpp"
#include "fit/transfer/output_map.hpp"
#include "fit/transfer/refit.hpp"
#include "numerics/centred_sums.hpp"
#include "numerics/golden_section.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLeastSamples = 50;
constexpr double kWidestScale =
    30.0;  // end of the search for a scale of the inputs; its inverse is the other
constexpr std::size_t kScales = 40;       // on a logarithmic grid, then refined
constexpr double kScaleTolerance = 1e-4;  ///< share of a step of the grid
constexpr double kClearly = 0.95;
constexpr std::string_view kPlace = "transfer";

bool is_linear(const std::string& expression) {
  constexpr std::array kOther{"stop(", "dahl(", "sign(", "tanh(", "sin(", "cos(", "atan(",
                              "abs(",  "sqrt(", "exp(",  "min(",  "max(", "^"};
  return std::ranges::none_of(
      kOther, [&](const char* other) { return expression.find(other) != std::string::npos; });
}

std::vector<std::string> channels_of_input(const EstimatorSettings& settings, std::size_t input) {
  const FeatureSpec spec{.inputs = {settings.features.inputs[input]},
                         .definitions = settings.features.definitions};
  std::vector<std::string> channels = FeaturePipeline(spec, settings.sample_rate_Hz).raw_inputs();
  std::ranges::sort(channels);
  return channels;
}

/// Inputs that are linear in the channels of the deflection, which is the first one, scale with it.
void scale_inputs(EstimatorSettings& settings, double scale) {
  if (scale == 1.0) return;
  const std::vector<std::string> first = channels_of_input(settings, 0);
  std::vector<std::string> scaled = settings.features.inputs;
  for (std::size_t i = 0; i < scaled.size(); ++i)
    if (i == 0 || (is_linear(scaled[i]) && channels_of_input(settings, i) == first))
      scaled[i] = fmt::format("({}) * {}", scaled[i], scale);
  settings.features.inputs = std::move(scaled);
}

/// The output's share of the settings. The inputs of the model have the same ranges as before.
void map_output(EstimatorSettings& settings, double gain, double offset) {
  settings.fallback.intercept = gain * settings.fallback.intercept + offset;
  for (double& slope : settings.fallback.slope) slope *= gain;
  settings.fallback.residual_std *= gain;
  for (double& edge : settings.residuals.edges) edge = gain * edge + offset;
  for (double& std_dev : settings.residuals.std_dev) std_dev *= gain;
  settings.strokes.growth *= gain;
  settings.strokes.limit *= gain;
  settings.target_uncertainty.constant *= gain;
}

bool is_positive(double value) { return value > 0.0 && std::isfinite(value); }

/// The same data with fewer usable samples.
TrainingData with_use(const TrainingData& data, std::size_t first, std::size_t last) {
  TrainingData part = data;
  std::size_t index = 0;
  for (Sequence& sequence : part.sequences)
    for (std::uint8_t& use : sequence.use)
      if (use != 0) {
        use = index >= first && index < last ? 1 : 0;
        ++index;
      }
  return part;
}

/// Estimates and measurements at the usable samples.
struct Pairs {
  std::vector<double> estimated;
  std::vector<double> measured;
};

Pairs pairs_of(const AnyModel::Parameters& parameters, const TrainingData& data) {
  AnyModel model(parameters);
  Pairs pairs;
  for (const Sequence& sequence : data.sequences) {
    const std::vector<Estimate> estimates = run(model, sequence);
    for (std::size_t n = 0; n < estimates.size(); ++n) {
      if (sequence.use[n] == 0 || !std::isfinite(estimates[n].value)) continue;
      pairs.estimated.push_back(estimates[n].value);
      pairs.measured.push_back(sequence.target[n]);
    }
  }
  return pairs;
}

/// Mean error of the first samples.
double mean_error(const Pairs& pairs, std::size_t most) {
  const std::size_t count = std::min(most, pairs.measured.size());
  double sum = 0.0;
  for (std::size_t n = 0; n < count; ++n) sum += pairs.measured[n] - pairs.estimated[n];
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

struct Line {
  double gain = 1.0;
  double offset = 0.0;
  double error = 0.0;  ///< sum of squares
};

/// Least squares with a gain above 0, else without.
Line line_of(const Pairs& pairs) {
  const CentredSums sums(pairs.estimated, pairs.measured);
  const double gain = sums.xx > 0.0 && sums.xy > 0.0 ? sums.xy / sums.xx : 1.0;
  return {.gain = gain,
          .offset = sums.y - gain * sums.x,
          .error = sums.yy - 2.0 * gain * sums.xy + gain * gain * sums.xx};
}

void note_transfer(ModelCard& card, const TransferTrial& of, const Dataset& dataset) {
  const auto note = [&](const std::string& key, auto value) {
    card.options["transfer." + key] = fmt::format("{}", value);
  };
  note("method", name(of.method));
  note("input_scale", of.map.input_scale);
  note("gain", of.map.gain);
  note("offset", of.map.offset);
  if (of.prior > 0.0) note("prior", of.prior);
  add_training_files(card, dataset);
}

class Transfer {
 public:
  Transfer(const ModelFile& base, const Dataset& dataset, const TransferOptions& options,
           const Progress& progress)
      : base_(base), dataset_(dataset), options_(options), progress_(progress) {
    check();
    all_ = data_with(1.0);
    const std::size_t samples = all_.usable_samples();
    if (samples < kLeastSamples)
      throw Error({.place = std::string(kPlace),
                   .expected = fmt::format("at least {} new samples of {}", kLeastSamples,
                                           base.settings.target),
                   .found = fmt::format("{}", samples),
                   .advice = "record the new joint for longer"});
    require_trainable(all_);
    const Pairs pairs = pairs_of(base.parameters, all_);
    require_plausible_reference(base.settings.target, {pairs.estimated, pairs.measured});
    samples_ = samples;
    fitted_ =
        samples - static_cast<std::size_t>(options.held_out_share * static_cast<double>(samples));
  }

  TransferResult result() {
    TransferResult result;
    constexpr std::array kMaps{TransferMethod::none, TransferMethod::offset,
                               TransferMethod::gain_offset, TransferMethod::data_sheets,
                               TransferMethod::scaled};
    for (const TransferMethod method : kMaps) {
      report_progress(progress_, 0.2 * static_cast<double>(method), "transferring");
      if (is_possible(method)) result.trials.push_back(trial(method));
    }
    add_refits(result);
    if (options_.method)
      std::erase_if(result.trials,
                    [&](const TransferTrial& of) { return of.method != *options_.method; });
    // A method with more freedom must be clearly better: the held-out part is of the same motion.
    for (std::size_t i = 1; i < result.trials.size(); ++i)
      if (result.trials[i].held_out_rmse < kClearly * result.trials[result.chosen].held_out_rmse)
        result.chosen = i;
    for (TransferTrial& of : result.trials) of.file = file_of(of);
    return result;
  }

 private:
  void check() const {
    const auto refuse = [](std::string problem, std::string advice) {
      throw UsageError({.place = std::string(kPlace),
                        .problem = std::move(problem),
                        .advice = std::move(advice)});
    };
    if (!(options_.held_out_share > 0.0 && options_.held_out_share < 0.9))
      throw UsageError({.place = "held-out share",
                        .expected = "above 0 and below 0.9",
                        .found = fmt::format("{}", options_.held_out_share)});
    if (options_.ratios &&
        (!is_positive(options_.ratios->stiffness) || !is_positive(options_.ratios->torque)))
      refuse("the ratios of stiffness and torque must be positive", "");
    static_cast<void>(with_output(base_.parameters, 1.0, 0.0));
    if (!options_.method) return;
    if (*options_.method == TransferMethod::data_sheets && !options_.ratios)
      refuse("data_sheets needs the stiffness and the rated torque of both joints",
             "Give both actuators, or the ratios.");
    if (*options_.method == TransferMethod::refit && refit_priors(base_.parameters).empty())
      refuse("a model with scheduled coefficients has no refit", "Use another method.");
  }

  [[nodiscard]] bool is_possible(TransferMethod method) const {
    return method != TransferMethod::data_sheets || options_.ratios.has_value();
  }

  /// The new data as inputs of the base, the deflection scaled.
  [[nodiscard]] TrainingData data_with(double scale) const {
    EstimatorSettings settings = base_.settings;
    scale_inputs(settings, scale);
    TrainingData data = training_data(dataset_, settings.features);
    if (data.target != base_.settings.target)
      throw Error({.place = std::string(kPlace),
                   .expected = "recordings with " + base_.settings.target + ", as the base",
                   .found = data.target});
    return data;
  }

  /// The first part, to which a method is fitted while methods are compared.
  [[nodiscard]] std::size_t end_of_fit(bool is_final) const {
    return is_final ? samples_ : fitted_;
  }

  [[nodiscard]] Pairs fit_pairs(double scale, bool is_final) const {
    return pairs_of(base_.parameters, with_use(data_with(scale), 0, end_of_fit(is_final)));
  }

  [[nodiscard]] TransferMap fitted_map(TransferMethod method, bool is_final) const {
    switch (method) {
      case TransferMethod::none:
      case TransferMethod::refit: return {};
      case TransferMethod::offset:
        return {.offset = mean_error(fit_pairs(1.0, is_final), options_.offset_samples)};
      case TransferMethod::gain_offset: {
        const Line line = line_of(fit_pairs(1.0, is_final));
        return {.gain = line.gain, .offset = line.offset};
      }
      case TransferMethod::data_sheets: {
        const TransferRatios& ratios = *options_.ratios;
        TransferMap map{.input_scale = ratios.stiffness / ratios.torque, .gain = ratios.torque};
        Pairs pairs = fit_pairs(map.input_scale, is_final);
        for (double& value : pairs.estimated) value *= map.gain;
        map.offset = mean_error(pairs, pairs.measured.size());
        return map;
      }
      case TransferMethod::scaled: return scaled_map(is_final);
    }
    return {};
  }

  /// Scale of the inputs by golden section around the best of a grid.
  [[nodiscard]] TransferMap scaled_map(bool is_final) const {
    const auto line_at = [&](double log_scale) {
      return line_of(fit_pairs(std::exp(log_scale), is_final));
    };
    const double widest = std::log(kWidestScale);
    const double step = 2.0 * widest / static_cast<double>(kScales);
    double best = 0.0;
    double least = line_at(0.0).error;
    for (std::size_t k = 0; k <= kScales; ++k) {
      const double at = -widest + step * static_cast<double>(k);
      const double error = line_at(at).error;
      if (error < least) {
        least = error;
        best = at;
      }
    }
    const auto error_at = [&](double log_scale) { return line_at(log_scale).error; };
    const double at = golden_section(error_at, best - step, best + step, kScaleTolerance * step);
    const Line line = line_at(at);
    return {.input_scale = std::exp(at), .gain = line.gain, .offset = line.offset};
  }

  [[nodiscard]] AnyModel::Parameters parameters_of(const TransferTrial& of, bool is_final) const {
    AnyModel::Parameters parameters = with_output(base_.parameters, of.map.gain, of.map.offset);
    if (of.prior == 0.0) return parameters;
    return refitted(parameters, base_.settings.ranges,
                    with_use(data_with(of.map.input_scale), 0, end_of_fit(is_final)), of.prior);
  }

  [[nodiscard]] double held_out_rmse(const TransferTrial& of) const {
    return evaluate(AnyModel(parameters_of(of, false)),
                    with_use(data_with(of.map.input_scale), fitted_, samples_))
        .rmse;
  }

  [[nodiscard]] TransferTrial trial(TransferMethod method) const {
    TransferTrial of{.file = base_, .method = method, .map = fitted_map(method, false)};
    of.held_out_rmse = held_out_rmse(of);
    return of;
  }

  void add_refits(TransferResult& result) {
    const std::vector<double> priors = refit_priors(base_.parameters);
    if (priors.empty()) {
      result.notes.emplace_back("a model with scheduled coefficients has no refit");
      return;
    }
    if (options_.method && *options_.method != TransferMethod::refit) return;
    TransferTrial best{.file = base_, .held_out_rmse = std::numeric_limits<double>::infinity()};
    const std::size_t maps = result.trials.size();
    for (std::size_t m = 0; m < maps; ++m)
      for (const double prior : priors) {
        report_progress(progress_, 0.8 + 0.2 * static_cast<double>(m) / static_cast<double>(maps),
                        "transferring");
        TransferTrial of{.file = base_,
                         .method = TransferMethod::refit,
                         .map = result.trials[m].map,
                         .prior = prior};
        of.held_out_rmse = held_out_rmse(of);
        // A weaker prior must be clearly better: the held-out part is of the same motion.
        if (!(of.held_out_rmse < kClearly * best.held_out_rmse)) continue;
        best = of;
        refit_from_ = result.trials[m].method;
      }
    if (std::isfinite(best.held_out_rmse)) result.trials.push_back(std::move(best));
  }

  /// Fitted to all of the new data. The error bars are those on what was held out.
  [[nodiscard]] ModelFile file_of(TransferTrial& of) const {
    of.map = fitted_map(of.method == TransferMethod::refit ? refit_from_ : of.method, true);
    ModelFile file = mapped(base_, of.map);
    if (of.prior > 0.0) file.parameters = parameters_of(of, true);
    const TrainingData data = data_with(of.map.input_scale);
    const EstimatorSettings fresh =
        guarded_settings(file.settings.features, data, AnyModel(file.parameters), nullptr,
                         {.rmse = of.held_out_rmse});
    EstimatorSettings& settings = file.settings;
    settings.fallback = fresh.fallback;
    settings.residuals = larger_of(settings.residuals, fresh.residuals);
    std::vector<double>& steps = settings.disturbances.largest_step;
    for (std::size_t k = 0; k < steps.size(); ++k)
      steps[k] = std::max(steps[k], fresh.disturbances.largest_step[k]);
    settings.disturbances.largest_travel =
        std::max(settings.disturbances.largest_travel, fresh.disturbances.largest_travel);
    settings.output.largest_target =
        std::max(settings.output.largest_target, fresh.output.largest_target);
    for (std::size_t i = 0; i < settings.ranges.lowest.size(); ++i) {
      settings.ranges.lowest[i] = std::min(settings.ranges.lowest[i], fresh.ranges.lowest[i]);
      settings.ranges.highest[i] = std::max(settings.ranges.highest[i], fresh.ranges.highest[i]);
    }
    // The new recordings determine the torque; what they do not state remains that of the base.
    if (const SensorUncertainty stated = training_uncertainty(dataset_); stated.is_stated())
      settings.target_uncertainty = stated;
    file.card.device_serial.clear();
    file.card.metrics.clear();
    file.card.held_out.clear();
    note_transfer(file.card, of, dataset_);
    return file;
  }

  const ModelFile& base_;
  const Dataset& dataset_;
  TransferOptions options_;
  const Progress& progress_;
  TrainingData all_;
  std::size_t samples_ = 0;
  std::size_t fitted_ =
      0;  ///< the first samples, to which a method is fitted while they are compared
  TransferMethod refit_from_ = TransferMethod::none;
};

}  // namespace

std::string_view name(TransferMethod method) noexcept {
  switch (method) {
    case TransferMethod::none: return "none";
    case TransferMethod::offset: return "offset";
    case TransferMethod::gain_offset: return "gain_offset";
    case TransferMethod::data_sheets: return "data_sheets";
    case TransferMethod::scaled: return "scaled";
    case TransferMethod::refit: return "refit";
  }
  return "";
}

TransferRatios transfer_ratios(const DataSheet& base, const DataSheet& joint) {
  return {.stiffness = second_stage_stiffness(joint) / second_stage_stiffness(base),
          .torque = joint.rating.torque_Nm.value / base.rating.torque_Nm.value};
}

ModelFile mapped(const ModelFile& base, const TransferMap& map) {
  if (!is_positive(map.input_scale) || !is_positive(map.gain) || !std::isfinite(map.offset))
    throw UsageError(
        {.place = std::string(kPlace),
         .expected = "a positive scale and gain, and a finite offset",
         .found = fmt::format("{}, {} and {}", map.input_scale, map.gain, map.offset)});
  ModelFile file = base;
  file.parameters = with_output(std::move(file.parameters), map.gain, map.offset);
  scale_inputs(file.settings, map.input_scale);
  map_output(file.settings, map.gain, map.offset);
  return file;
}

TransferResult transfer_model(const ModelFile& base, const Dataset& dataset,
                              const TransferOptions& options, const Progress& progress) {
  return Transfer(base, dataset, options, progress).result();
}

}  // namespace torsio
