#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/arm/contact_detector.hpp"

namespace torsio {

inline constexpr int kContactsFormatVersion = 1;

/// The thresholds of contacts of one arm, and the motion from which they were learned. Plain data.
struct ContactsFile {
  struct Joint {
    std::string name;
    ContactDetector::Joint detector = {};
  };
  std::string arm;                 ///< name of the arm
  double payload_kg = 0.0;         ///< with which it moved
  double bandwidth_rad_s = 100.0;  ///< K in `MomentumObserver`
  std::vector<Joint> joints = {};
  double hours = 0.0;                  ///< duration of the motion without contacts
  double false_alarms_per_hour = 0.0;  ///< for which the factors were chosen
  /// Upper bound of the rate of false alarms with 95 % confidence, if none occurred in these hours: 3 / hours.
  double upper_bound_per_hour = 0.0;

  [[nodiscard]] ContactDetector::Settings settings() const;
};

/// @returns 3 / hours: the rate of false alarms that motion of this length without one supports, with 95 % confidence
[[nodiscard]] double supported_rate_per_hour(double hours) noexcept;

/// Writes the file (JSON, docs/robot/contacts.md) completely or not at all. @throws Error as `ContactDetector`.
void save_contacts(const std::filesystem::path& path, const ContactsFile& file);

/// @throws Error naming the entry: not JSON, another format or version, an entry that is missing, unknown or of another
/// kind, hours that do not support the rate, or numbers that `ContactDetector` refuses.
[[nodiscard]] ContactsFile read_contacts(const std::filesystem::path& path);

/// The same for the text of a file, which errors name as `place`.
[[nodiscard]] ContactsFile parse_contacts(std::string_view text, const std::string& place);

/// @throws Error if the file belongs to another arm, other joints, another payload (by more than 1 g) or another observer.
void require_contacts_of(const ContactsFile& file, const ArmModel& arm, double bandwidth_rad_s,
                         const std::string& place);

}  // namespace torsio
