#pragma once

#include <string>
#include <vector>

#include "report/html/model_report.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// One model on one recording, sample by sample.
struct ModelRun {
  std::string label;
  std::vector<double> value;
  std::vector<double> std_dev;   ///< `ScoredRun::compared_std_dev`; NaN without an error bar
  std::vector<double> residual;  ///< estimate less target at new samples that are scored; else NaN
  std::vector<std::uint8_t> guarded;  ///< 1: a guard or fault
};

/// A recording with the runs of all models that can run on it.
struct RecordRuns {
  const Recording* recording = nullptr;
  std::vector<double> input;  ///< the first input of the first model
  std::string input_name;
  const Channel* target = nullptr;
  std::vector<ModelRun> runs;
  std::vector<std::string> failures;  ///< "label: reason"
};

[[nodiscard]] RecordRuns run_models(const Dataset& dataset, const DatasetRecord& record,
                                    const std::vector<ReportedModel>& models, Role role);

}  // namespace torsio
