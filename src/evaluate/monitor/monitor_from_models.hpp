#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/files/monitor_file.hpp"

namespace torsio {

/// A source of a monitor as a user gives it.
struct SourceFiles {
  TorqueSource source;
  std::string model;          ///< model file of the torque
  std::string friction = {};  ///< model file of the drive's friction; empty: none
};

/// A monitor that is to be calibrated, beside its recordings.
struct MonitorRequest {
  std::vector<SourceFiles> sources;
  /// "EXPRESSION" or "EXPRESSION moves with EXPRESSION"; empty: every channel of the sources, each angle with
  /// the one before it in the drive, and the deflection.
  std::vector<std::string> signals = {};
  std::filesystem::path
      output;  ///< the monitor file, which names the models relative to its folder
  std::string device_serial = {};  ///< empty: of any joint
  std::string valid_until = {};    ///< as 2027-11-22; empty: no end
  CalibrationOptions options = {};
};

/// With which mapping the recordings of a model were read.
struct ModelMapping {
  std::string file;     ///< the model's
  std::string mapping;  ///< `ModelCard::mapping`
};

/// The mapping of all models. @throws Error if they were trained with different ones.
[[nodiscard]] const ModelMapping& common_mapping(const std::vector<ModelMapping>& models);
/// The mappings of the models of a monitor file. @throws Error as `read_monitor` and `load_model`.
[[nodiscard]] std::vector<ModelMapping> model_mappings(const std::string& monitor_file);

/// @param place of the day in messages
/// @throws UsageError unless it is empty, or a day that is not over.
void check_last_day(std::string_view date, const std::string& place);

/// Models and signals of a request, before the recordings are read.
class MonitorFromModels {
 public:
  /// @throws UsageError for fewer than two sources, or one model in two of them; Error for a model that cannot
  /// be read or is of another joint.
  explicit MonitorFromModels(MonitorRequest request);

  [[nodiscard]] const std::vector<ModelMapping>& mappings() const noexcept { return mappings_; }
  /// Channels that the recordings must have, in the order of the alphabet.
  [[nodiscard]] const std::vector<std::string>& channels() const noexcept { return channels_; }
  /// Chooses the limits (`calibrate_monitor`) and writes the monitor file.
  CalibratedMonitor calibrate(const Dataset& fault_free, const Progress& progress = {});

 private:
  void add(const SourceFiles& files);
  void find_channels();

  MonitorRequest request_;
  std::vector<SourceModel> sources_;
  std::vector<ModelMapping> mappings_;
  std::vector<std::string> channels_;
  MonitorPlan plan_;
  MonitorFile file_;
};

}  // namespace torsio
