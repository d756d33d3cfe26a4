#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "store/database.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {

/// The columns of a row by their place.
class RowReader {
 public:
  explicit RowReader(const DatabaseRow& row) : row_(row) {}

  [[nodiscard]] std::int64_t whole(std::size_t column) const;  ///< NULL: 0
  [[nodiscard]] double real(std::size_t column) const;         ///< NULL: NaN
  [[nodiscard]] std::string text(std::size_t column) const;    ///< NULL: empty
  [[nodiscard]] std::string bytes(std::size_t column) const;
  [[nodiscard]] std::optional<std::int64_t> id(std::size_t column) const;  ///< NULL: none

 private:
  const DatabaseRow& row_;
};

/// A value that is not finite is NULL: databases sort NaN differently.
[[nodiscard]] DatabaseValue number_or_null(double value);
[[nodiscard]] DatabaseValue id_or_null(const std::optional<std::int64_t>& id);
[[nodiscard]] DatabaseValue text_or_null(std::string_view text);

/// One change of the registry at a time.
inline constexpr std::int64_t kRegistryLock = 0x746f7273'696f0002;

/// A word that names one call, so that its row is entered once also if the transaction is repeated.
[[nodiscard]] std::string new_request();

inline constexpr std::string_view kDeviceColumns = "d.serial, d.type, d.note, d.added_at";
[[nodiscard]] RegisteredDevice device_from(const RowReader& row);

inline constexpr std::string_view kModelColumns =
    "m.id, m.device, m.sha256, m.family, m.file, m.torsio_version, m.options, m.seed, m.metrics, "
    "m.parent, m.trial, m.added_at, m.added_by, m.note, m.size, "
    "(SELECT b.sha256 FROM model_bases b WHERE b.model = m.id)";
inline constexpr std::size_t kModelColumnCount = 16;
/// Without its recordings.
[[nodiscard]] RegisteredModel model_from(const RowReader& row);

inline constexpr std::string_view kDriftColumns =
    "h.id, h.device, h.model, h.recording, h.found_at, h.verdict, h.rmse, h.bias, h.stiffness, "
    "h.stiffness_error, h.friction, h.friction_error, h.zero, h.zero_error, h.temperature_C, "
    "h.details";
[[nodiscard]] DriftEntry drift_from(const RowReader& row);

/// @throws UsageError with the nearest serial number if there is no such device.
void require_device(Database& database, std::string_view serial, const std::string& place);
/// @throws UsageError if there is no such model.
[[nodiscard]] RegisteredModel find_model(Database& database, std::int64_t id,
                                         const std::string& place);
/// @throws UsageError if there is no such device or model, or the model is one of another device.
RegisteredModel require_model_of(Database& database, std::string_view serial, std::int64_t id,
                                 const std::string& place);

/// The bytes of a model of the registry. @throws Error if their hash is another one.
[[nodiscard]] std::string checked_bytes(Database& database, const RegisteredModel& model,
                                        const std::string& place);

}  // namespace torsio
