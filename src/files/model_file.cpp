#include "torsio/files/model_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "files/card_json.hpp"
#include "files/known_families.hpp"
#include "files/leaf_tensors.hpp"
#include "files/safetensors.hpp"
#include "files/whole_file.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr const char* kCardKey = "torsio";

/// Error bars and what limits a recovery may be NaN: no evidence.
bool may_be_nan(std::string_view path) {
  return path == "fallback.residual_std" || path == "residuals.std_dev" ||
         path == "guards.output.largest_target" || path == "guards.disturbances.warm_up_s" ||
         path == "guards.disturbances.largest_travel";
}

const std::string& card_text(const Safetensors& contents, std::string_view place) {
  const auto card = contents.metadata.find(kCardKey);
  if (card == contents.metadata.end())
    throw Error({.place = fmt::format("{}: /__metadata__/{}", place, kCardKey),
                 .expected = "the card of a torsio model",
                 .found = "none",
                 .advice = "This is a safetensors file of another program: give the file that "
                           "torsio fit wrote."});
  return card->second;
}

void check_serial(const ModelCard& card, std::string_view place, std::string_view expected) {
  if (expected.empty() || card.device_serial == expected) return;
  throw Error(
      {.place = fmt::format("{}: device_serial", place),
       .expected = fmt::format("'{}'", expected),
       .found = card.device_serial.empty() ? "none" : fmt::format("'{}'", card.device_serial),
       .advice = "The model belongs to another actuator: load the one that was fitted to "
                 "this device."});
}

void check_nothing_left(const Safetensors& contents, std::string_view place,
                        std::string_view family) {
  if (contents.tensors.empty()) return;
  throw Error({.place = fmt::format("{}: /{}", place, contents.tensors.begin()->first),
               .expected = fmt::format("only tensors of the family {}", family),
               .found = "one that it does not have",
               .advice = "The contents of the file do not match its card: fit the model again."});
}

/// Clocks that differ by less are one: a recording's rate is measured.
bool is_same_rate(double rate_Hz, double own_Hz) {
  constexpr double kSameRate = 1e-3;
  return std::abs(rate_Hz - own_Hz) <= kSameRate * own_Hz;
}

/// A discrete model runs at the rate that it was trained at; a static one runs at any.
void check_sample_rate(const AnyModel& model, double rate_Hz) {
  const double period_s = model.sample_period();
  if (model.is_rediscretised() || !(period_s > 0.0)) return;
  const double own_Hz = 1.0 / period_s;
  if (is_same_rate(rate_Hz, own_Hz)) return;
  throw Error(
      {.place = "sample rate",
       .expected = fmt::format("{:.6g} Hz, at which the {} was trained", own_Hz, model.family()),
       .found = fmt::format("{:.6g} Hz", rate_Hz),
       .advice = fmt::format(
           "A {} steps by its own sample period and runs at no other rate: resample what "
           "it is given to {:.6g} Hz (--rate, where recordings are read), or train one at "
           "{:.6g} Hz.",
           model.family(), own_Hz, rate_Hz)});
}

/// Checks what only the estimator itself can: that settings and model fit together.
Estimator make_estimator_at(const ModelFile& model, double sample_rate_Hz, std::string_view place) {
  try {
    return make_estimator(model, sample_rate_Hz);
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place =
        report.place.empty() ? std::string(place) : fmt::format("{}: {}", place, report.place);
    throw Error(std::move(report));
  }
}

ModelFile read_model(std::span<const std::byte> bytes, std::string_view place,
                     std::string_view expected_serial) {
  Safetensors contents = parse_safetensors(bytes, place);
  ModelFile model = model_of_card(card_text(contents, place), fmt::format("{}: card", place));
  check_serial(model.card, place, expected_serial);
  with_own_type(model.parameters, [&](auto& parameters) {
    take_leaves(contents, "model", place, parameters, may_be_nan);
  });
  take_leaves(contents, "guards.ranges", place, model.settings.ranges, may_be_nan);
  if (has_tensors_of(contents, "guards.disturbances"))  // files of older builds have none
    take_leaves(contents, "guards.disturbances", place, model.settings.disturbances, may_be_nan);
  if (has_tensors_of(contents, "guards.output"))
    take_leaves(contents, "guards.output", place, model.settings.output, may_be_nan);
  if (has_tensors_of(contents, "guards.strokes"))
    take_leaves(contents, "guards.strokes", place, model.settings.strokes, may_be_nan);
  take_leaves(contents, "fallback", place, model.settings.fallback, may_be_nan);
  take_leaves(contents, "residuals", place, model.settings.residuals, may_be_nan);
  if (has_tensors_of(contents, "target_uncertainty"))
    take_leaves(contents, "target_uncertainty", place, model.settings.target_uncertainty,
                may_be_nan);
  check_nothing_left(contents, place, model.parameters.family());
  return model;
}

}  // namespace

std::vector<std::byte> model_bytes(const ModelFile& model) {
  Safetensors contents;
  contents.metadata[kCardKey] = card_json(model);
  with_own_type(model.parameters,
                [&](const auto& parameters) { put_leaves(contents, "model", parameters); });
  put_leaves(contents, "guards.ranges", model.settings.ranges);
  put_leaves(contents, "guards.disturbances", model.settings.disturbances);
  put_leaves(contents, "guards.output", model.settings.output);
  if (model.settings.strokes.growth > 0.0)
    put_leaves(contents, "guards.strokes", model.settings.strokes);
  put_leaves(contents, "fallback", model.settings.fallback);
  put_leaves(contents, "residuals", model.settings.residuals);
  if (model.settings.target_uncertainty.is_stated())
    put_leaves(contents, "target_uncertainty", model.settings.target_uncertainty);
  return safetensors_bytes(contents);
}

ModelFile parse_model(std::span<const std::byte> bytes, std::string_view place,
                      std::string_view expected_serial) {
  ModelFile model = read_model(bytes, place, expected_serial);
  (void)make_estimator_at(model, model.settings.sample_rate_Hz, place);
  return model;
}

void save_model(const std::filesystem::path& path, const ModelFile& model) {
  const auto bytes = model_bytes(model);
  (void)parse_model(bytes, path.string());
  write_whole_file(path, bytes);
}

ModelFile load_model(const std::filesystem::path& path, std::string_view expected_serial) {
  return parse_model(read_whole_file(path, kMaxModelFileBytes), path.string(), expected_serial);
}

Estimator make_estimator(const ModelFile& model) {
  const double rate_Hz = model.settings.sample_rate_Hz;
  const AnyModel as_in_file(model.parameters);
  check_sample_rate(as_in_file, rate_Hz);
  if (!(rate_Hz > 0.0)) return {model.settings, as_in_file};
  return {model.settings, AnyModel(model.parameters.at_sample_period(1.0 / rate_Hz))};
}

Estimator make_estimator(const ModelFile& model, double sample_rate_Hz) {
  ModelFile resampled = model;
  // In a longer period an input moves further; in a shorter one its noise is the same.
  const double ratio = model.settings.sample_rate_Hz / sample_rate_Hz;
  const double longer = std::isfinite(ratio) ? std::max(1.0, ratio) : 1.0;
  for (double& step : resampled.settings.disturbances.largest_step) step *= longer;
  resampled.settings.disturbances.largest_travel *= longer;
  const double own_Hz = model.settings.sample_rate_Hz;
  if (own_Hz > 0.0 && sample_rate_Hz > 0.0 && !is_same_rate(sample_rate_Hz, own_Hz))
    resampled.settings.features = at_sample_rate(model.settings.features, own_Hz, sample_rate_Hz);
  resampled.settings.sample_rate_Hz = sample_rate_Hz;
  return make_estimator(resampled);
}

Estimator load_estimator(const std::filesystem::path& path, const EstimatorOptions& options) {
  const double rate_Hz = options.rate_Hz;
  if (!std::isnan(rate_Hz) && !(std::isfinite(rate_Hz) && rate_Hz > 0.0))
    throw UsageError({.place = "load_estimator: rate_Hz",
                      .expected = "a positive number, or NaN for the rate in the file",
                      .found = fmt::format("{}", rate_Hz)});
  const std::string place = path.string();
  const auto bytes = read_whole_file(path, kMaxModelFileBytes);
  const ModelFile model = read_model(bytes, place, options.serial);
  return make_estimator_at(model, std::isnan(rate_Hz) ? model.settings.sample_rate_Hz : rate_Hz,
                           place);
}

}  // namespace torsio
