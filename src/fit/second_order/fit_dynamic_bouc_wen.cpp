#include "fit/second_order/fit_dynamic_bouc_wen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/second_order/simulation_fit.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A mass on a spring: what a Bouc-Wen element is not yet part of.
struct Oscillator {
  double rate_per_s = 0.0;     ///< sqrt(k / m)
  double damping_ratio = 0.0;  ///< c / (2 sqrt(k m))
  double stiffness = 0.0;
  double miss = HUGE_VAL;  ///< sum of squares over the target's
};

DynamicBoucWen::Parameters of(const Oscillator& oscillator, DynamicBoucWen::Parameters with) {
  with.stiffness = oscillator.stiffness;
  with.mass = oscillator.stiffness / (oscillator.rate_per_s * oscillator.rate_per_s);
  with.damping = 2.0 * oscillator.damping_ratio * oscillator.stiffness / oscillator.rate_per_s;
  return with;
}

/// Computes stiffness and miss: from rest, the compliance that explains most of the target.
void evaluate(Oscillator& oscillator, const TrainingData& data, DynamicBoucWen::Parameters with) {
  constexpr std::size_t kMaxSamples = 8000;
  oscillator.stiffness = 1.0;
  with = of(oscillator, with);
  with.lowest = -1e300;
  with.highest = 1e300;
  double output_output = 0.0;
  double output_target = 0.0;
  double target_target = 0.0;
  for (const Sequence& sequence : data.sequences) {
    std::vector<double> output(std::min(kMaxSamples, sequence.target.size()));
    if (!run_from(model_if_valid<DynamicBoucWen>(with), {}, sequence, output)) return;
    for (std::size_t n = 0; n < output.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      output_output += output[n] * output[n];
      output_target += output[n] * sequence.target[n];
      target_target += sequence.target[n] * sequence.target[n];
    }
  }
  if (!(output_target > 0.0)) return;
  oscillator.stiffness = output_output / output_target;
  oscillator.miss = 1.0 - output_target * output_target / (output_output * target_target);
}

Oscillator best_oscillator(const TrainingData& data, const DynamicBoucWen::Parameters& with,
                           const Progress& progress) {
  constexpr int kRates = 60;
  const double slowest = 2.0 * std::numbers::pi * data.sample_rate_Hz / 4000.0;
  const double fastest = 2.5 * data.sample_rate_Hz * static_cast<double>(with.time.substeps);
  Oscillator best;
  for (int i = 0; i < kRates; ++i)
    for (const double damping_ratio : {0.03, 0.1, 0.3, 1.0}) {
      Oscillator oscillator{
          .rate_per_s = slowest * std::pow(fastest / slowest, static_cast<double>(i) / kRates),
          .damping_ratio = damping_ratio};
      report_progress(progress, 0.0, "finding a mass on a spring");
      evaluate(oscillator, data, with);
      if (oscillator.miss < best.miss) best = oscillator;
    }
  if (std::isinf(best.miss))
    throw Error({.place = std::string(DynamicBoucWen::kFamily),
                 .expected = "a target that follows the force, on average in its direction",
                 .found = "no mass on a spring that explains any of it",
                 .advice = "Check the signs and which channel drives."});
  return best;
}

/// The parameters that are searched: the mass on its spring, the element, gains but the first.
std::vector<double> listed(const DynamicBoucWen::Parameters& p, bool with_exponent) {
  std::vector<double> all{p.mass, p.damping, p.stiffness, p.hysteretic_stiffness, p.loss, p.skew};
  if (with_exponent) all.push_back(p.exponent);
  all.insert(all.end(), p.gains.begin() + 1, p.gains.end());
  return all;
}

DynamicBoucWen::Parameters with_listed(DynamicBoucWen::Parameters p,
                                       std::span<const double> listed) {
  const std::array fields{&p.mass, &p.damping, &p.stiffness, &p.hysteretic_stiffness,
                          &p.loss, &p.skew,    &p.exponent};
  const std::size_t further = p.gains.size() - 1;
  const std::size_t own = listed.size() - further;
  for (std::size_t i = 0; i < own; ++i) *fields[i] = listed[i];
  std::ranges::copy(listed.last(further), p.gains.begin() + 1);
  return p;
}

double largest_target(const TrainingData& data) {
  double largest = 0.0;
  for (const double y : usable_table(data).target) largest = std::max(largest, std::abs(y));
  return largest;
}

/// As `listed`; typical sizes from a mass on a spring of about the same motion.
std::vector<SearchedParameter> searched(const DynamicBoucWen::Parameters& linear, double largest,
                                        const TrainingData& data, bool with_exponent) {
  const std::string y = unit_label(data.target);
  const std::string u = unit_label(data.inputs[0].expression);
  const double n = linear.exponent;
  const double k = linear.stiffness;
  const double bend = k / std::pow(k * largest, n);
  const std::string per_y = y.empty() ? "" : "/" + y;
  const std::string loss_unit = n == 1.0 ? (y.empty() ? "" : "1/" + y) : "";
  std::vector<SearchedParameter> all{
      {.name = "mass",
       .unit = u + " s^2" + per_y,
       .typical = linear.mass,
       .lowest = 1e-6 * linear.mass},
      {.name = "damping",
       .unit = u + " s" + per_y,
       .typical = std::sqrt(k * linear.mass),
       .lowest = 0.0},
      {.name = "stiffness", .unit = u + per_y, .typical = k, .lowest = 0.0},
      {.name = "hysteretic_stiffness", .unit = u + per_y, .typical = k, .lowest = 0.0},
      {.name = "loss", .unit = loss_unit, .typical = bend, .lowest = 0.0},
      {.name = "skew", .unit = loss_unit, .typical = bend},
      {.name = "exponent", .unit = "", .typical = 1.0, .lowest = 1.0, .highest = 10.0}};
  if (!with_exponent) all.pop_back();
  std::ranges::move(further_gains(data), std::back_inserter(all));
  return all;
}

SimulatedModel simulated(std::vector<SearchedParameter> parameters,
                         const DynamicBoucWen::Parameters& with) {
  return {.parameters = std::move(parameters),
          .run =
              [with](std::span<const double> values, std::span<const double> state,
                     const Sequence& sequence, std::span<double> output) {
                return run_from(model_if_valid<DynamicBoucWen>(with_listed(with, values)), state,
                                sequence, output);
              },
          .free_states = 3};
}

/// The spring shared between the linear and the hysteretic part, bent to either side.
std::vector<std::vector<double>> hysteretic_starts(const DynamicBoucWen::Parameters& linear,
                                                   double largest, bool with_exponent) {
  struct Bend {
    double loss;
    double skew;
  };
  std::vector<std::vector<double>> starts;
  for (const double share : {0.2, 0.5, 0.8})
    for (const Bend bend : {Bend{0.3, 0.0}, Bend{0.5, -0.5}, Bend{1.5, 0.5}, Bend{1.5, -2.0}}) {
      DynamicBoucWen::Parameters p = linear;
      p.stiffness = (1.0 - share) * linear.stiffness;
      p.hysteretic_stiffness = share * linear.stiffness;
      const double size =
          p.hysteretic_stiffness / std::pow(p.hysteretic_stiffness * largest, p.exponent);
      p.loss = bend.loss * size;
      p.skew = bend.skew * size;
      starts.push_back(listed(p, with_exponent));
    }
  return starts;
}

}  // namespace

Fitted<DynamicBoucWen> fit_dynamic_bouc_wen(const TrainingData& data,
                                            const DynamicBoucWenOptions& options,
                                            const Progress& progress) {
  require_excitation(data);
  report_progress(progress, 0.0, "fitting dynamic_bouc_wen");
  const EndStops stops = end_stops(data);
  const bool searches_exponent = std::isnan(options.exponent);
  std::vector<double> gains(data.input_count(), 0.0);
  gains[0] = 1.0;
  DynamicBoucWen::Parameters linear{.exponent = searches_exponent ? 1.5 : options.exponent,
                                    .gains = gains,
                                    .time = {.sample_period_s = 1.0 / data.sample_rate_Hz,
                                             .substeps = options.substeps,
                                             .input_order = options.input_order},
                                    .lowest = stops.lowest,
                                    .highest = stops.highest};
  linear = of(best_oscillator(data, linear, progress), linear);
  const double largest = largest_target(data);
  SimulationFitOptions search{.first_horizon = options.first_horizon,
                              .max_iterations = options.iterations,
                              .progress = progress};
  const SimulatedModel model =
      simulated(searched(linear, largest, data, searches_exponent), linear);
  SimulationFit fit =
      fit_by_simulation(model, data, hysteretic_starts(linear, largest, searches_exponent), search);
  Fitted<DynamicBoucWen> fitted{.parameters = with_listed(linear, fit.parameters),
                                .notes = std::move(fit.notes),
                                .table = std::move(fit.table)};
  fitted.notes.push_back(fmt::format("free runs through the training records miss {:.3g} {} RMSE",
                                     fit.rmse, unit_label(data.target)));
  return fitted;
}

}  // namespace torsio
