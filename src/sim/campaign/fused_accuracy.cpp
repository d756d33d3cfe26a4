#include "sim/campaign/fused_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/report_progress.hpp"
#include "data/recording_rows.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/campaign/monitor_recipe.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {
namespace {

/// Sums over one run.
struct Run {
  std::vector<double> squares;          ///< errors of the sources, squared
  std::vector<double> without_squares;  ///< the same without this source
  double fused_squares = 0.0;
  std::size_t samples = 0;
  std::size_t within = 0;
  std::size_t within_2 = 0;

  [[nodiscard]] double rmse(double square_sum) const {
    return std::sqrt(square_sum / static_cast<double>(samples));
  }
};

Run run_once(const Recording& recording, const MonitoredTorque& monitored) {
  TorqueSources sources = monitored.sources();
  Redundancy redundancy = monitored.redundancy();
  RecordingRows rows(recording, sources.raw_inputs());
  const std::vector<double>& true_Nm = recording.channel("truth_torque_Nm").values;
  const std::size_t count = sources.size();
  Run run{.squares = std::vector<double>(count, 0.0),
          .without_squares = std::vector<double>(count, 0.0)};
  std::vector<Estimate> left;
  const DenormalsOff denormals_off;
  sources.reset();
  for (std::size_t n = 0; n < recording.size(); ++n) {
    const std::span<const Estimate> estimates = sources.step(rows.at(n));
    const auto is_sound = [](const Estimate& of) { return of.fault == Fault::none; };
    if (!std::ranges::all_of(estimates, is_sound)) continue;
    ++run.samples;
    for (std::size_t i = 0; i < count; ++i) {
      run.squares[i] += std::pow(estimates[i].value - true_Nm[n], 2);
      left.assign(estimates.begin(), estimates.end());
      left[i].fault = Fault::input_not_finite;
      run.without_squares[i] += std::pow(redundancy.step(left).value_Nm - true_Nm[n], 2);
    }
    const FusedTorque fused = redundancy.step(estimates);
    const double error_Nm = std::abs(fused.value_Nm - true_Nm[n]);
    run.fused_squares += error_Nm * error_Nm;
    run.within += error_Nm <= fused.std_dev_Nm ? 1 : 0;
    run.within_2 += error_Nm <= 2.0 * fused.std_dev_Nm ? 1 : 0;
  }
  return run;
}

/// The index of the smallest one; `but` is left out.
std::size_t smallest(const std::vector<double>& values, std::size_t but) {
  std::size_t best = but == 0 ? 1 : 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (i != but && values[i] < values[best]) best = i;
  return best;
}

}  // namespace

FusedAccuracy fused_accuracy(const DataSheet& sheet, const MonitoredTorque& monitored,
                             std::size_t runs, std::uint64_t seed, double duration_s,
                             const Progress& progress) {
  const std::size_t count = monitored.sources().size();
  const std::size_t first_runs = std::max<std::size_t>(runs / 4, 1);
  FusedAccuracy result;
  result.actuator = full_name(sheet);
  result.runs = runs;
  result.sources = monitored.monitor().settings().sources;
  result.source_rmse_Nm.assign(count, 0.0);
  const auto none = count;
  std::vector<double> chosen_on(count, 0.0);
  std::vector<double> ratio_sums(count + 1, 0.0);
  std::vector<double> largest(count + 1, 0.0);
  std::size_t samples = 0;
  std::size_t within = 0;
  std::size_t within_2 = 0;
  for (std::size_t r = 0; r < first_runs + runs; ++r) {
    report_progress(progress, static_cast<double>(r) / static_cast<double>(first_runs + runs),
                    "accuracy of the combined torque");
    DutyRun work{.seed = seed + r, .duration_s = duration_s, .with_truth = true};
    work.settings.impacts_per_min = 0.0;
    const Run run = run_once(with_source_delay(duty_recording(sheet, work, progress)), monitored);
    if (run.samples == 0)
      throw Error({.place = result.actuator,
                   .problem = "in a run the sources were never all valid",
                   .advice = "make the runs longer: friction settles with the motion"});
    if (r < first_runs) {
      for (std::size_t i = 0; i < count; ++i) chosen_on[i] += run.squares[i];
      continue;
    }
    for (std::size_t i = 0; i < count; ++i)
      result.source_rmse_Nm[i] += run.rmse(run.squares[i]) / static_cast<double>(runs);
    result.fused_rmse_Nm += run.rmse(run.fused_squares) / static_cast<double>(runs);
    for (std::size_t out = 0; out <= count; ++out) {
      if (out < count && count < 3) continue;  // one is left
      const double square = out < count ? run.without_squares[out] : run.fused_squares;
      const double ratio = run.rmse(square) / run.rmse(run.squares[smallest(chosen_on, out)]);
      ratio_sums[out] += ratio / static_cast<double>(runs);
      largest[out] = std::max(largest[out], ratio);
    }
    samples += run.samples;
    within += run.within;
    within_2 += run.within_2;
  }
  result.best = result.sources[smallest(chosen_on, none)];
  result.mean_ratio = ratio_sums[none];
  result.largest_ratio = largest[none];
  for (std::size_t i = 0; i < count && count > 2; ++i)
    result.without.push_back({result.sources[i], ratio_sums[i], largest[i]});
  result.within_std_dev = static_cast<double>(within) / static_cast<double>(samples);
  result.within_2_std_dev = static_cast<double>(within_2) / static_cast<double>(samples);
  return result;
}

}  // namespace torsio
