#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/joint_trait.hpp"
#include "fleet/outliers.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/load.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// One joint of a fleet.
struct FleetJoint {
  std::string serial;
  std::string type = {};                ///< joints of one type are compared; may be empty
  std::vector<std::string> train = {};  ///< recordings
  std::vector<std::string> test = {};   ///< empty: the last 30 % of the others
};

/// Simulated specimens in place of recordings, some of them with a production fault.
struct SimulatedFleet {
  std::string actuator = "dfki-50";
  std::uint64_t first = 1;  ///< serial numbers, both included
  std::uint64_t last = 1;
  std::size_t faults = 0;  ///< number of joints with a fault, drawn by the seed
};

/// All that a worker needs to calibrate the joints of a fleet.
struct CalibrationRequest {
  std::vector<FleetJoint> joints = {};
  std::optional<SimulatedFleet> simulated = {};  ///< in place of joints
  std::string mapping = {};
  double rate_Hz = 0.0;  ///< 0: that of the logs
  std::string target = {};
  std::vector<std::string> inputs = {};  ///< empty: the default of the recordings
  std::string model = "grey_box";        ///< one entry of `model_choices`
  /// Model file that all joints are compared with and start from; empty: for each type the model of its first
  /// joint whose recordings pass the checks.
  std::string base = {};
  std::uint64_t seed = 1;
  bool only_compares = false;  ///< no models are made: the test at the end of a production line
  /// SHA-256 of each file, by its path, when the study began; those that are missing are found by `CalibrationStudy`.
  std::map<std::string, std::string> sha256 = {};
};

/// A fleet as it is named by a person.
struct FleetChoice {
  std::string list;       ///< path of a list of joints, or
  std::string specimens;  ///< simulated ones: "dfki-50#0001..#1000"
  std::size_t faults = 0;
  std::string base;   ///< empty: that of the list
  std::string model;  ///< empty: the default
  std::uint64_t seed = 1;
  bool only_compares = false;
};

/// How the recordings of a request are read.
[[nodiscard]] LoadOptions load_options(const CalibrationRequest& request, const Progress& progress);

/// Reads a list of joints (docs/fleet.md); paths are relative to the list.
/// @throws Error naming file, line, what was expected and found.
[[nodiscard]] CalibrationRequest read_fleet_list(const std::string& path);

/// @throws UsageError unless there is either a list or specimens, with at most one fault for each; for a family that
/// does not exist; as `read_fleet_list`.
[[nodiscard]] CalibrationRequest calibration_request(const FleetChoice& choice);

/// What was found about one joint.
struct CalibratedJoint {
  struct Method {
    std::string name;  ///< "base", "transfer: scaled", "own fit"
    double held_out_rmse =
        kNotMeasured;  ///< on the last 30 % of the training samples: by it the method is chosen
    double test_rmse = kNotMeasured;
  };
  std::string serial;
  std::string type = {};
  std::string fault = {};                      ///< the planted one, of a simulated joint
  JointTrait fault_trait = JointTrait::noise;  ///< in which it is to be found
  std::string failure = {};                    ///< why there is no model; empty: there is one
  std::vector<std::string> warnings = {};      ///< what the checks warn of
  JointTraits traits = {};
  std::vector<Method> methods = {};
  std::string chosen = {};          ///< name of the chosen method
  double test_rmse = kNotMeasured;  ///< error of the chosen method
  /// Hash of the model file that the chosen model was made from; empty: it was fitted to the joint alone.
  std::string base_sha256 = {};
  std::int64_t trial = 0;
};

/// A joint that differs from the others of its type.
struct FleetOutlier {
  std::size_t joint = 0;                 ///< in `FleetCalibration::joints`
  JointTrait trait = JointTrait::noise;  ///< the kind
  double value = kNotMeasured;
  double median = kNotMeasured;  ///< median of its type
  double expected =
      kNotMeasured;  ///< number of sound joints of this fleet that lie so far out, at most
  std::vector<JointTrait> others = {};  ///< further traits that lie outside
};

/// The result for a fleet.
struct FleetCalibration {
  struct OfType {
    std::string type;
    std::vector<std::size_t> members = {};             ///< in `FleetCalibration::joints`
    std::array<OutlierTest, kJointTraits> tests = {};  ///< their values are those of `compared`
    /// False: too few joints, none of which can be an outlier.
    [[nodiscard]] bool is_compared() const noexcept;
  };
  std::vector<CalibratedJoint> joints = {};
  std::vector<OfType> types = {};
  std::vector<FleetOutlier> outliers = {};  ///< the least expected first
  /// Whether a joint was compared with others of its type.
  [[nodiscard]] bool is_compared(std::size_t joint) const noexcept;
};

/// The name of this kind in a store.
inline constexpr std::string_view kCalibrationStudy = "calibrate";

/// One trial for each joint: the recordings are checked; the joint is compared with the base model; the base is
/// transferred to it, a model is fitted to it, and the better one on held-out samples is its model. The joint whose
/// model is the base has that one.
class CalibrationStudy : public StudyKind {
 public:
  /// @throws Error if a file cannot be read.
  explicit CalibrationStudy(CalibrationRequest request);
  ~CalibrationStudy() override;

  /// With absolute paths and the hashes of all files.
  [[nodiscard]] const CalibrationRequest& request() const noexcept;
  [[nodiscard]] std::vector<Trial> first_trials() const;
  [[nodiscard]] TrialResult run(const Claim& claim, const Progress& progress) override;
  [[nodiscard]] HalvingDecision decide(const std::string& /*group*/, int /*step*/,
                                       std::span<const TrialRecord> /*trials*/) override {
    return {};
  }

 private:
  class Plan;
  std::unique_ptr<Plan> plan_;
};

/// The text of a request that is kept in a store, with the hashes of its files, which have to be there.
[[nodiscard]] std::string calibration_text(const CalibrationRequest& request);
/// Begins or resumes the study of that name. @throws UsageError naming what differs if it is another calibration, or as
/// `StudyStore::create_or_resume`; Error if a recording has changed since it began.
[[nodiscard]] StoredStudy begin_calibration(StudyStore& store, const std::string& name,
                                            const CalibrationStudy& kind);
/// The study of a store. Its trials refuse recordings that have changed since it began.
[[nodiscard]] std::unique_ptr<CalibrationStudy> calibration_study(const StoredStudy& study);

/// The results of a study and its outliers, of the joints that have finished.
[[nodiscard]] FleetCalibration calibration_result(StudyStore& store, const StoredStudy& study);

/// Compares the joints of each type; fills `types` and `outliers`.
void find_fleet_outliers(FleetCalibration& fleet);

}  // namespace torsio
