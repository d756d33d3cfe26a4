#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

struct StudyOptions {
  std::uint64_t seed = 1;
  std::size_t repeats = 3;  ///< each with plants' noise, weights and folds of its own
  bool is_quick = false;    ///< shorter recordings and smaller networks: to see that it runs
};

/// How a model did in a torque loop; means over the runs, in `Study::unit` (specification 3.10).
struct StudyTracking {
  double mad = kNotMeasured;
  double mad_std = kNotMeasured;  ///< of one run; NaN of fewer than two
  double std_abs = kNotMeasured;
  double mad_to_linear =
      kNotMeasured;  ///< MAD over that of the line of the sweeps, where both came to their end
  std::size_t limit_cycles = 0;  ///< runs with one
  std::size_t stopped = 0;       ///< runs that diverged or failed, in no mean
};

/// A figure that a paper prints, as it prints it.
struct PaperFigure {
  std::string_view paper;      ///< its number in docs/sources.md
  std::string_view item;       ///< table, figure or section
  std::string_view condition;  ///< under which it was found
  std::string_view quantity;   ///< in the paper's own term
  std::string_view text;       ///< with the digits that are printed
  std::string_view unit;
  double value = kNotMeasured;
};

/// Which quantity of a row a published figure is to be compared with.
enum class RowQuantity {
  rmse,            ///< in `Study::unit`
  rmse_percent,    ///< RMSE in percent; paper 002 names no normaliser, ours is the full scale
  max_percent,     ///< largest |error|, likewise
  percent_of_max,  ///< RMSE in percent of the largest |target|
  fit_percent,     ///< best fit
  mad,
  std_abs,
  mad_to_linear,
  mad_percent  ///< MAD in percent of the amplitude of the reference
};

/// Where in a study's table a published figure belongs.
struct PaperEntry {
  std::string_view condition;
  std::string_view model;
  RowQuantity quantity;
  PaperFigure figure;
};

/// One model under one condition, over all repeats and folds.
struct StudyRow {
  std::string condition;
  std::string model;
  std::size_t runs = 0;            ///< fits that the statistics are of; 0: only published figures
  double rmse = kNotMeasured;      ///< mean, in `Study::unit`; NaN of no run, as all means
  double rmse_std = kNotMeasured;  ///< of one run; NaN of fewer than two
  double percent = kNotMeasured;  ///< mean of 100 rmse / (largest |target| of the judged recording)
  double largest = kNotMeasured;  ///< mean of that largest |target|
  double max_abs = kNotMeasured;  ///< largest |error| of all runs
  std::optional<double> one_step = {};  ///< mean RMSE one step ahead, of a model that feeds back
  std::size_t blank = 0;                ///< of the runs: fit_percent below 5, no more than the mean
  double guarded_percent = 0.0;         ///< of the scored samples, answered by a guard
  std::size_t diverged = 0;             ///< of the runs
  double fit_percent = kNotMeasured;    ///< mean of `Metrics::fit_percent` (BF)
  std::vector<std::pair<RowQuantity, PaperFigure>> published = {};
  std::optional<StudyTracking> tracking = {};  ///< of all rows of a study, or of none
  double fit_seconds = kNotMeasured;           ///< mean of the runs
  double step_ns = kNotMeasured;               ///< mean of the runs' medians
  double within_std_dev = kNotMeasured;  ///< mean of `Score::within_std_dev`; NaN: no error bar
  double within_2_std_dev = kNotMeasured;
  std::string failure = {};  ///< why a fit failed, of a study that goes on then

  /// Every run was fitted and stayed within the output's range.
  [[nodiscard]] bool is_ranked() const { return runs > 0 && diverged == 0 && failure.empty(); }
};

/// How one model of a study stands to the best under a condition.
struct StudyVerdict {
  std::string condition;
  std::string best = {};  ///< model of the least RMSE among those that are ranked
  double best_rmse = 0.0;
  std::optional<double> rmse = {};  ///< of the judged model; none if it is not ranked

  [[nodiscard]] bool is_near_best() const { return rmse && *rmse <= kNear * best_rmse; }
  static constexpr double kNear = 1.05;
};

/// A simulated bench that a study used.
struct StudyPlant {
  std::string name;
  std::string fingerprint;  ///< of every number of its data sheet
};

/// A paper's experiment, run here.
struct Study {
  std::string protocol;  ///< what was recorded, trained on and judged on
  std::string unit;      ///< of the errors
  StudyOptions options;
  std::vector<StudyPlant> plants = {};
  std::vector<StudyRow> rows = {};  ///< condition by condition, in the order of their first fit
  std::optional<double> full_scale =
      {};                   ///< of the sensor, in `unit`: errors are also told in % of it
  std::string judged = {};  ///< model that the study is about: ratios and verdicts are told
  std::vector<std::string> notes = {};  ///< what the rows say in words, settings behind their names
  bool tells_fit_time = false;          ///< how long a fit took is part of what it asks
};

/// Condition by condition. @throws Error if none is ranked under one.
[[nodiscard]] std::vector<StudyVerdict> verdicts(const Study& study);

struct StudyInfo {
  std::string_view name;
  std::string_view paper;  ///< number and table or figure
  std::string_view title;
  Study (*run)(const StudyOptions& options, const Progress& progress);
  std::span<const PaperEntry> published = {};  ///< every figure that its table shows beside ours
  bool needs_recordings = false;  ///< in TORSIO_DATA or ../shared/data: must be named to be run
};

/// What `torsio reproduce` can run, in the papers' order. Claims to be tested, not targets
/// (specification 5).
[[nodiscard]] std::span<const StudyInfo> studies() noexcept;
/// @throws UsageError that lists them.
[[nodiscard]] const StudyInfo& find_study(std::string_view name);

/// Deterministic for the options. @throws UsageError unless there are 1 to 100 repeats; Cancelled;
/// Error if a model cannot be fitted.
[[nodiscard]] Study run_study(const StudyInfo& study, const StudyOptions& options,
                              const Progress& progress = {});

}  // namespace torsio
