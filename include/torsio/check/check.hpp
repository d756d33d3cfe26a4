#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

enum class Verdict : std::uint8_t { pass, warn, fail };

[[nodiscard]] std::string_view name(Verdict verdict) noexcept;

/// Samples [begin, end) of a recording.
struct SampleRange {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// The result of one check for one recording, or for all of them together.
struct Finding {
  Verdict verdict = Verdict::pass;
  std::string check;      ///< clock, gaps, delay, sign, ...
  std::string recording;  ///< empty: the recordings together
  std::string message;    ///< the measured values
  std::string advice;     ///< what to do; empty if nothing
  /// Where in the recording; empty if it has no place, or is everywhere.
  std::vector<SampleRange> places = {};
};

/// Checks whether a torque model can be trained on these recordings. Looks at each channel of the
/// inputs and at the target: values that are missing, constant or saturated; frozen sensors; coarse
/// codes; units; gaps and slips; the delay and the sign between the first input and the target;
/// their relation early and late in a record; reversals and speeds; offsets that differ between
/// records; a target computed from an input; what `train_model` refuses; test data
/// outside the training range. Every check
/// reports at least one finding, PASS ones included, in a fixed order.
[[nodiscard]] std::vector<Finding> check_dataset(const Dataset& dataset, const FeatureSpec& spec);

/// What a fit needs of the checks, and the data that they have made, so that it need not make them
/// again.
struct FitCheck {
  std::vector<Finding> failures;  ///< the FAIL findings of `check_dataset`
  std::string leak;               ///< as `find_leak`
  /// With the test data, if there are any; none if the data are not usable or a check before
  /// them has failed.
  std::optional<LearningData> data = {};
};
/// Checks that can only warn are not run.
/// @throws UsageError as `refuse_leak`.
[[nodiscard]] FitCheck check_for_fit(const Dataset& dataset, const FeatureSpec& spec,
                                     bool allow_leak);

/// The unit mistake ("degrees and radians") that makes a recording's slope of target over first
/// input differ from the one that a model was trained on, `EstimatorSettings::fallback`; empty if
/// they do not differ by a unit's factor, or the recording has no slope.
[[nodiscard]] std::string unit_doubt(const Recording& recording, const EstimatorSettings& trained);

}  // namespace torsio
