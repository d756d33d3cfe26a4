#pragma once

#include <span>
#include <string>

#include "torsio/core/progress.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// What the trials of a study compute. Several threads run trials of one object at the same time.
class StudyKind {
 public:
  virtual ~StudyKind() = default;
  StudyKind(const StudyKind&) = delete;
  StudyKind& operator=(const StudyKind&) = delete;

  /// Deterministic: the same result on every machine, but for its times. A trial that cannot be
  /// computed from its data is a failed result.
  /// @throws Cancelled if `progress` asks to stop; Error if no trial of the study can be run here.
  [[nodiscard]] virtual TrialResult run(const Claim& claim, const Progress& progress) = 0;
  /// After a halving step of a group, of which no trial is waiting or running. It depends on the
  /// values alone.
  [[nodiscard]] virtual HalvingDecision decide(const std::string& group, int step,
                                               std::span<const TrialRecord> trials) = 0;
  /// The activity of a running trial, for the display: "mlp:layers=16-16, fold 2".
  [[nodiscard]] virtual std::string label(const Claim& claim) const { return claim.key; }

 protected:
  StudyKind() = default;
};

}  // namespace torsio
