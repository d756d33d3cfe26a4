#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

struct StudyOptions {
  std::uint64_t seed = 1;
  std::size_t repeats = 3;  ///< each with plants' noise, weights and folds of its own
  bool is_quick = false;    ///< shorter recordings and smaller networks, as a quick test
};

/// The seeds of test recordings begin here: no training recording has one of them.
inline constexpr std::uint64_t kFirstTestSeed = 50;

/// A figure that a paper prints, as it prints it.
struct PaperFigure {
  std::string_view paper;      ///< its number in docs/development/sources.md
  std::string_view item;       ///< table, figure or section
  std::string_view condition;  ///< condition of the measurement
  std::string_view quantity;   ///< in the paper's term
  std::string_view text;       ///< the digits as printed
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

/// One model under one condition, over all repeats and folds: what every kind of study has.
struct StudyRow {
  std::string condition = {};
  std::string model = {};
  std::size_t runs = 0;            ///< fits in the statistics; 0: only published figures
  double rmse = kNotMeasured;      ///< mean, in `Study::unit`; NaN without a run, as all means
  double rmse_std = kNotMeasured;  ///< standard deviation of one run; NaN for fewer than two
  std::vector<std::pair<RowQuantity, PaperFigure>> published = {};
};

/// Errors of a model on records that it was not trained on.
struct ErrorRow : StudyRow {
  double percent = kNotMeasured;   ///< mean of 100 rmse / (largest |target| of the test recording)
  double largest = kNotMeasured;   ///< mean of that largest |target|
  double max_abs = kNotMeasured;   ///< largest |error| of all runs
  double one_step = kNotMeasured;  ///< mean RMSE one step ahead; NaN of a model without feedback
  std::size_t blank = 0;           ///< runs with fit_percent below 5, no more than the mean
  double guarded_percent = 0.0;    ///< share of the scored samples with the fallback of a guard
  std::size_t diverged = 0;        ///< number of runs that diverged
  double fit_percent = kNotMeasured;  ///< mean of `Metrics::fit_percent` (BF)
  double fit_seconds = kNotMeasured;  ///< mean of the runs
};

struct ErrorTable {
  std::vector<ErrorRow> rows = {};  ///< condition by condition, in the order of their first fit
  std::optional<double> full_scale =
      {};  ///< full scale of the sensor: errors are also shown in % of it
  bool shows_fit_time = false;
};

/// The same where all families are compared, and one may fail.
struct ComparisonRow : StudyRow {
  double percent = kNotMeasured;
  double step_ns = kNotMeasured;         ///< mean of the runs' medians
  double within_std_dev = kNotMeasured;  ///< mean of `Score::within_std_dev`; NaN: no error bar
  double within_2_std_dev = kNotMeasured;
  double mean_std_dev = kNotMeasured;     ///< mean of `Score::mean_std_dev`
  double without_std_dev = kNotMeasured;  ///< mean of `Score::without_std_dev`
  std::size_t diverged = 0;
  std::string failure = {};  ///< why a fit failed; the study continues

  /// Every run was fitted and stayed within the output's range.
  [[nodiscard]] bool is_ranked() const { return runs > 0 && diverged == 0 && failure.empty(); }
};

struct ComparisonTable {
  std::vector<ComparisonRow> rows = {};
  std::string subject;  ///< the model that the study is about
};

/// Errors of a torque loop through the inverse of a model; means over the runs (specification
/// 3.10).
struct LoopRow : StudyRow {
  double mad = kNotMeasured;
  double mad_std = kNotMeasured;  ///< standard deviation of one run; NaN for fewer than two
  double std_abs = kNotMeasured;
  /// MAD over that of the linear model of the sweeps, where both completed the run.
  double mad_to_linear = kNotMeasured;
  std::size_t limit_cycles = 0;  ///< runs with one
  std::size_t stopped = 0;       ///< runs that diverged or failed, in no mean
};

struct LoopTable {
  std::vector<LoopRow> rows = {};
};

/// One quantity under one condition, beside the figure of the paper if it prints one.
struct QuantityRow {
  std::string condition;
  std::string quantity;
  double value = kNotMeasured;
  std::string unit;
  std::optional<PaperFigure> published = {};
  std::string remark = {};
};

struct QuantityTable {
  std::vector<QuantityRow> rows = {};
};

/// How far the subject of a comparison is from the best model under a condition.
struct StudyVerdict {
  std::string condition;
  std::string best = {};  ///< model of the least RMSE among those that are ranked
  double best_rmse = 0.0;
  std::optional<double> rmse = {};  ///< RMSE of the subject; none if it is not ranked

  [[nodiscard]] bool is_near_best() const { return rmse && *rmse <= kNear * best_rmse; }
  static constexpr double kNear = 1.05;
};

/// A simulated bench that a study used.
struct StudyPlant {
  std::string name;
  std::string fingerprint;  ///< hash of name, variant and every number of its data sheet
};

/// A paper's experiment, run here.
struct Study {
  std::string protocol;  ///< what was recorded, trained on and tested on
  std::string unit;      ///< unit of the errors
  StudyOptions options;
  std::vector<StudyPlant> plants = {};
  std::variant<ErrorTable, ComparisonTable, LoopTable, QuantityTable> table = {};
  std::vector<std::string> notes = {};     ///< conclusions, and settings of the named models
  std::vector<ReportFigure> figures = {};  ///< the paper's, drawn again; empty: none
  std::size_t figure_columns = 1;          ///< how many beside each other
};

/// Condition by condition. @throws Error if none is ranked under one.
[[nodiscard]] std::vector<StudyVerdict> verdicts(const ComparisonTable& table);

struct StudyInfo {
  std::string_view name;
  std::string_view paper;  ///< number and table or figure
  std::string_view title;
  Study (*run)(const StudyOptions& options, const Progress& progress);
  double minutes = 0.0;                        ///< about how long the default takes on two cores
  std::span<const PaperEntry> published = {};  ///< every figure that its table shows beside ours
  bool must_be_named =
      false;  ///< takes long, or needs recordings (TORSIO_DATA or ../shared/data) or a solver
  bool has_figures = false;  ///< `Study::figures` are set
};

/// Deterministic for the options. @throws UsageError unless there are 1 to 100 repeats; Cancelled;
/// Error if a model cannot be fitted.
[[nodiscard]] Study run_study(const StudyInfo& study, const StudyOptions& options,
                              const Progress& progress = {});

}  // namespace torsio
