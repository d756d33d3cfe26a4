#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/store/store_address.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

// All times are seconds since 1970 by the clock of the database.

/// A joint or an actuator. Its serial number is its identity and never changes.
struct RegisteredDevice {
  std::string serial;
  std::string type = {};  ///< "dfki-50"; may be empty
  std::string note = {};
  double added_at_s = kNotMeasured;
};

/// A recording, known by the hash of its file, which remains where it is.
struct RegisteredRecording {
  std::string sha256;
  std::string device = {};  ///< serial number; empty: not stated
  std::string file = {};    ///< absolute path, or as the card of a model names it
  std::size_t samples = 0;  ///< 0: not known
  double rate_Hz = kNotMeasured;
  double added_at_s = kNotMeasured;
};

/// For what a model used a recording.
struct RecordingUse {
  std::string sha256;
  std::string role;  ///< "train", "validation", "test"
  bool operator==(const RecordingUse&) const = default;
};

/// A model file that is to be added.
struct NewModel {
  std::string device;                         ///< serial number, which must be that of the file
  std::string bytes;                          ///< the file as it is
  std::string file;                           ///< its name
  std::string by = {};                        ///< who adds it
  std::string note = {};                      ///< may be empty
  std::vector<RecordingUse> recordings = {};  ///< besides the training files on its card
  std::optional<std::int64_t> parent = {};    ///< the model that it was made from
  std::optional<std::int64_t> trial = {};     ///< the trial of a study that found it
  /// Hash of the model file that it was transferred from, which need not be in the registry; may be empty.
  std::string base_sha256 = {};
};
/// A model of the registry. The file itself is read by `model_bytes`.
struct RegisteredModel {
  std::int64_t id = 0;
  std::string device;
  std::string sha256;
  std::string family;
  std::string file;
  std::string torsio_version;
  std::map<std::string, std::string> options = {};  ///< options of its fit
  std::string seed = {};
  std::map<std::string, double> metrics = {};  ///< on its card: "rmse", ...
  std::optional<std::int64_t> parent = {};
  std::optional<std::int64_t> trial = {};
  double added_at_s = kNotMeasured;
  std::string added_by = {};
  std::string note = {};
  std::size_t size = 0;          ///< number of bytes of the file
  std::string base_sha256 = {};  ///< as `NewModel::base_sha256`
  std::vector<RecordingUse> recordings = {};
};

/// A change of the current model of a device.
struct Promotion {
  std::int64_t id = 0;
  std::string device;
  std::int64_t model = 0;  ///< current afterwards
  bool is_roll_back = false;
  double made_at_s = kNotMeasured;
  std::string made_by;
  std::string reason;
};

/// What a recording showed of the model of a device. A value that was not determined is NaN.
struct DriftEntry {
  std::int64_t id = 0;  ///< the store counts them
  std::string device;
  std::int64_t model = 0;
  std::string recording;  ///< SHA-256
  double found_at_s = kNotMeasured;
  std::string verdict = {};         ///< "changed", ...
  double rmse = kNotMeasured;       ///< in the unit of the target
  double bias = kNotMeasured;       ///< in the unit of the target
  double stiffness = kNotMeasured;  ///< relative change
  double stiffness_error = kNotMeasured;
  double friction = kNotMeasured;  ///< relative change
  double friction_error = kNotMeasured;
  double zero = kNotMeasured;  ///< change, in the unit of the target
  double zero_error = kNotMeasured;
  double temperature_degC = kNotMeasured;
  std::string details = {};  ///< JSON
};

struct DeviceSummary {
  RegisteredDevice device;
  std::optional<RegisteredModel> current = {};
  double current_since_s = kNotMeasured;
  std::optional<DriftEntry> last_drift = {};
  std::size_t models = 0;
  std::size_t recordings = 0;  ///< recordings of the device or of its models
};

struct RegistryFinding {
  bool is_error = true;  ///< false: a remark, the registry itself is sound
  std::string place;     ///< "model 7 of dfki-50#0001"
  std::string text;
};

/// Devices with their recordings, models and drift, in the database of a `StudyStore`. A model is that of one device; a
/// device has at most one current model, which is one of its own. Models, promotions and drift are only added.
///
/// Threads and a server that is lost: as `StudyStore`. Each function is one transaction, which has one effect also if
/// it is repeated.
/// @throws Error for what a function refuses, UsageError for an unknown device or model, with the nearest name.
class Registry {
 public:
  /// Opens or creates the store. @throws Error also for a store of another version.
  explicit Registry(const StoreAddress& address, StudyStore::OnWait on_wait = {});
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  [[nodiscard]] const StoreAddress& address() const noexcept { return address_; }

  /// Adds a device, or the type and the note of one that has none. @returns whether it is new.
  /// @throws Error if it is there with another type.
  bool add_device(const RegisteredDevice& device);
  [[nodiscard]] RegisteredDevice device(std::string_view serial);
  [[nodiscard]] std::vector<RegisteredDevice> devices();
  [[nodiscard]] std::vector<DeviceSummary> summaries();

  /// Adds a recording, or what was not known of one that is there. @throws Error if it is one of another device.
  void add_recording(const RegisteredRecording& recording);
  /// @param serial empty: of all devices
  [[nodiscard]] std::vector<RegisteredRecording> recordings(std::string_view serial = {});

  /// @returns its number, also of one that is there already. @throws Error if the file is not a model of this device.
  std::int64_t add_model(const NewModel& model);
  [[nodiscard]] RegisteredModel model(std::int64_t id);
  /// @param serial empty: of all devices
  [[nodiscard]] std::vector<RegisteredModel> models(std::string_view serial = {});
  /// The model, the one that it was made from, and so on.
  [[nodiscard]] std::vector<RegisteredModel> lineage(std::int64_t id);
  /// A model whose file has this hash, of any device; of several the one that was added first.
  [[nodiscard]] std::optional<RegisteredModel> model_of_file(std::string_view sha256);
  /// The file as it was added. @throws Error if its hash is another one, or if it is of another device.
  [[nodiscard]] std::string model_bytes(std::string_view serial, std::int64_t id);

  /// Makes a model the current one of its device. @returns false if it is that already.
  /// @throws UsageError if it is a model of another device.
  bool promote(std::string_view serial, std::int64_t model, std::string_view by,
               std::string_view reason = {});
  /// Makes the model current that was so before the current one was promoted; again, the one before that.
  /// @returns its number. @throws Error if there was none.
  std::int64_t roll_back(std::string_view serial, std::string_view by,
                         std::string_view reason = {});
  [[nodiscard]] std::optional<RegisteredModel> current(std::string_view serial);
  [[nodiscard]] std::vector<Promotion> promotions(std::string_view serial);

  /// @throws Error if the model is one of another device, or the recording is not registered.
  void add_drift(const DriftEntry& entry);
  [[nodiscard]] std::vector<DriftEntry> drift_history(std::string_view serial);

  /// Checks the database, the bytes of all models, the history of promotions, and the files of recordings.
  [[nodiscard]] std::vector<RegistryFinding> verify(const Progress& progress = {});

 private:
  StoreAddress address_;
  std::unique_ptr<StoreConnection> connection_;
};

/// @throws Error unless the file is a model of its device, which `Registry::add_model` requires.
void require_own_model(const NewModel& model);

struct StoreUpgrade {
  std::int64_t before = 0;  ///< version of the tables; 0: there were none
  std::int64_t after = 0;
};
/// Upgrades the tables of a store to those of this version of torsio, and keeps what is in them.
/// @throws Error for a store of a newer version.
StoreUpgrade upgrade_store(const StoreAddress& address);

}  // namespace torsio
