#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "torsio/check/advise/advice.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/evaluate/attribution.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/evaluate/fit_report.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/report/attribution.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

// The pages of the verbs. Each states its result in `summary`; the origin has what the data state (hashes), to which
// the program adds its command and versions.
namespace torsio {

/// Ranking, error against the time of a step with the Pareto front, loops and time series of all
/// models, residuals of the best, the card of the best; why a model failed.
[[nodiscard]] ReportDocument comparison_report(const Comparison& comparison, const Dataset& dataset,
                                               const Progress& progress = {});

/// Means over the folds with their standard deviations, and the error in each fold.
[[nodiscard]] ReportDocument cross_validation_report(const CrossValidation& validation,
                                                     const Dataset& dataset);

/// Scores of one model on each role and recording, and its pictures.
/// @param runs of the recordings, of which the results are the scores
[[nodiscard]] ReportDocument evaluation_report(const Results& results,
                                               const std::vector<ScoredRun>& runs,
                                               const ModelFile& file, const std::string& model,
                                               const Dataset& dataset,
                                               const Progress& progress = {});

/// The scores of `evaluation_report`, correlations of the residuals, coefficients with standard errors.
[[nodiscard]] ReportDocument fit_page(const ReportedFit& fit, const std::string& model,
                                      const Dataset& dataset, const Progress& progress = {});

/// Each finding, and the channels of each recording with the findings that have a place in it.
/// @param dataset none: it could not be read, which is a finding, or it has no spring
[[nodiscard]] ReportDocument check_report(const std::vector<Finding>& findings,
                                          const Dataset* dataset, const FeatureSpec& spec,
                                          const Advice* advice,
                                          const std::vector<DriveAdvice>& drive_advice = {});

/// Inputs, estimate with its error bar, and faults of each recording.
[[nodiscard]] ReportDocument estimate_report(const std::vector<EstimatedRecording>& estimated,
                                             const std::vector<EstimateSummary>& summaries,
                                             const ModelFile& file, const std::string& model);

/// All channels of a simulated recording, and the torque over the twist.
/// @param twist_rad of the spring, at every sample
[[nodiscard]] ReportDocument simulation_report(const Recording& recording,
                                               std::span<const double> twist_rad,
                                               const std::string& title);

/// Scores of the models, and reference, answer, error and each term of the command of one run.
/// @param record of the first run of a model; empty: none
[[nodiscard]] ReportDocument tracking_report(std::span<const TrackingRow> rows,
                                             const Recording* record);

/// Wanted, linear and rendered impedance of each model as Bode and Nyquist diagrams, and the motion of
/// the hand with the first. @param runs at least one, of the same task
[[nodiscard]] ReportDocument impedance_report(std::span<const ImpedanceRun> runs);

/// Scores of the joints, the arm drawn from the side and from above in poses of the run, torques of all joints.
/// @param summary sentences
[[nodiscard]] ReportDocument arm_report(const ArmSetup& setup, const ArmRun& run,
                                        std::vector<std::string> summary);

/// Findings, errors of the free runs, parameters with their 95 % intervals, friction over speed and load, the structures
/// that were compared, and the measured and simulated motion of each recording.
/// @param recordings those of `identified.recordings`, in their order
[[nodiscard]] ReportDocument identification_report(const DriveIdentification& identified,
                                                   const std::vector<Recording>& recordings,
                                                   const std::vector<DriveAdvice>& advice);

/// A page with the text of a verb and its figures.
[[nodiscard]] ReportDocument text_report(std::string title, std::vector<std::string> summary,
                                         const std::string& text,
                                         std::vector<ReportFigure> figures = {});

// The pages of the verbs that take a model file to other data or ask what it uses, as in `verb_reports.hpp`.

/// Shapley values and the error when an input is shuffled, with the caveat.
[[nodiscard]] ReportDocument attribution_report(const Attribution& attribution,
                                                const AttributionSubject& subject);

/// Frozen and adapted errors, and both models on the held-out samples.
/// @param frozen the model before the adaptation
[[nodiscard]] ReportDocument adaptation_report(const AdaptedModel& adapted, const ModelFile& frozen,
                                               const std::string& model, const Dataset& dataset,
                                               const Progress& progress = {});

/// Errors of the methods, the learning curve, and base and transferred model on the held-out samples.
[[nodiscard]] ReportDocument transfer_report(const TransferEvaluation& evaluation,
                                             const TransferCurve& curve, const ModelFile& base,
                                             const Dataset& dataset, const Progress& progress = {});

/// Each quantity with its 95 % interval, and the model on the recordings.
[[nodiscard]] ReportDocument drift_report(const Drift& drift, const ModelFile& file,
                                          const Dataset& dataset, const Progress& progress = {});

/// The torques of the sources over time with the findings at their places.
[[nodiscard]] ReportDocument monitor_report(const std::vector<MonitorReplay>& replays,
                                            const MonitorSettings& settings);

}  // namespace torsio
