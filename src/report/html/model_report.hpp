#pragma once

#include <string>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// A model under the name that the tables have for it.
struct ReportedModel {
  std::string label;
  const ModelFile* file = nullptr;
  /// Its runs through recordings of the dataset, if it was scored; null: it is run for the page.
  const std::vector<ScoredRun>* runs = nullptr;
};

/// The recordings of a held-out role (test, else validation, else train; at most four): target over
/// the first input, all channels over time with the estimates and their error bars, residuals over
/// deflection, rate, torque and time, their distribution, correlation and spectrum, and the claimed
/// against the found error bars. The first model is shown with its error bar, the first three at once, the
/// others when the reader asks for them. A model that cannot run on a recording is left out with the reason.
/// @throws Cancelled.
[[nodiscard]] std::vector<ReportSection> model_sections(const Dataset& dataset,
                                                        const std::vector<ReportedModel>& models,
                                                        const Progress& progress = {});

/// The card of a model file: what it was trained on and how.
[[nodiscard]] ReportSection card_section(const ModelFile& file, const std::string& title);

/// Hashes of the recordings.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> origin_of(const Dataset& dataset);

}  // namespace torsio
