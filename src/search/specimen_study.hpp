#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// Simulated specimens of one actuator, each with its manufacturing tolerances: what the production
/// spread does to a model that is fitted on each joint.
struct SpecimenRequest {
  std::string actuator = "dfki-50";  ///< a name of `find_data_sheet` without a serial number
  std::uint64_t first = 1;           ///< serial numbers, both included
  std::uint64_t last = 1;
  std::string experiment = "sweep";
  double duration_s = 10.0;        ///< length of the recordings for the fit and for the error
  std::string model = "grey_box";  ///< one entry of `model_choices`
  std::uint64_t seed = 1;          ///< seed of the sensors' noise and the fit
};

/// Reads "dfki-50#0001..#1000". @throws UsageError
[[nodiscard]] SpecimenRequest specimen_range(std::string_view text);

/// The name of this kind in a store.
inline constexpr std::string_view kSpecimenStudy = "specimens";

/// One trial for each specimen: two recordings are simulated, a model is fitted on the first, and
/// its RMSE on the second is the value.
class SpecimenStudy : public StudyKind {
 public:
  /// @throws UsageError if `request.model` is several models, or has a family or setting that does not exist.
  explicit SpecimenStudy(SpecimenRequest request);

  [[nodiscard]] std::vector<Trial> first_trials() const;
  [[nodiscard]] TrialResult run(const Claim& claim, const Progress& progress) override;
  [[nodiscard]] HalvingDecision decide(const std::string& /*group*/, int /*step*/,
                                       std::span<const TrialRecord> /*trials*/) override {
    return {};
  }

 private:
  SpecimenRequest request_;
};

[[nodiscard]] std::string request_text(const SpecimenRequest& request);
/// @throws Error if the spec cannot be read.
[[nodiscard]] std::unique_ptr<SpecimenStudy> specimen_study(const StoredStudy& study);

}  // namespace torsio
