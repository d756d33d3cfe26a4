#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "study_rows.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

inline constexpr const char* kSensorActuator = "rubber-clutch";
inline constexpr double kSensorFullScale_Nm = 0.5;  // where the clutch slips
/// A network with memory is not valid before; the other models are not scored there either.
inline constexpr std::size_t kSensorWarmUp = 200;

/// A model of the table: what it is called, and how `--models` would ask for it.
struct SensorCandidate {
  std::string label;
  std::string model;
  bool has_rate = false;  ///< given the twist's rate besides
};

/// The sensor of paper 002: what its models are trained and scored on.
struct SensorBench {
  Dataset dataset;
  StudyConditions conditions = {};

  /// @param begin, end samples that are scored
  void add_test(const Recording& from, const std::string& condition, std::size_t begin,
                std::size_t end);
};

/// A recording of the bench, with the truth.
[[nodiscard]] Recording sensor_recording(const std::string& experiment, std::uint64_t seed);

/// Trained on the grid. No model is initialised with the measured torque: all start from rest, as
/// the bench.
[[nodiscard]] SensorBench trained_on_grid(std::uint64_t seed);

/// How a candidate is trained: on the twist, and its rate where it has that.
[[nodiscard]] ModelChoice choice_of(const SensorCandidate& candidate, const SensorBench& bench);

/// Fits all candidates and adds their rows on the test recordings. @returns the models, in their order
std::vector<ComparedModel> compare_into(StudyRows& rows, const SensorBench& bench,
                                        const std::vector<SensorCandidate>& candidates,
                                        std::uint64_t seed, const Progress& progress);

}  // namespace torsio
