#pragma once

#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/evaluate/attribution.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/report/attribution.hpp"
#include "torsio/report/document/report_document.hpp"

// The pages of the verbs that take a model file to other data or ask what it uses, as in `verb_reports.hpp`.
namespace torsio {

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
