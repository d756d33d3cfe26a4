#include "torsio/arm/contacts_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "files/json_object.hpp"
#include "files/json_text.hpp"
#include "files/whole_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxContactsBytes = std::size_t{1} << 20U;
constexpr std::string_view kContactsFormat = "torsio contacts";
constexpr std::string_view kContactsAdvice =
    "The file is damaged: learn the contacts again (torsio arm learn-contacts).";
constexpr double kEventsOfNone = 3.0;  // 95 % bound of a Poisson count of which none occurred
constexpr double kRateRounding = 1e-9;
constexpr double kSamePayload_kg = 1e-3;
constexpr double kContactCheckRate_Hz = 1000.0;  // any: the detector's settings are checked

double positive(const JsonObject& object, const char* key, const std::string& place) {
  const double value = object.number(key);
  if (std::isfinite(value) && value > 0.0) return value;
  throw Error({.place = fmt::format("{}/{}", place, key),
               .expected = "a number above 0",
               .found = std::isnan(value) ? std::string("null") : fmt::format("{:g}", value),
               .advice = std::string(kContactsAdvice)});
}

ContactsFile::Joint contacts_joint(const JsonObject& object, const std::string& place) {
  object.allow_only({"joint", "variance", "factor"});
  ContactsFile::Joint joint{.name = object.text("joint")};
  const std::vector<double> variance = object.numbers("variance");
  ExternalTorqueTerms& coefficients = joint.detector.error.coefficients;
  if (variance.size() != coefficients.size())
    throw Error({.place = fmt::format("{}/{}/variance", place, joint.name),
                 .expected = fmt::format("{} coefficients", coefficients.size()),
                 .found = fmt::format("{}", variance.size()),
                 .advice = std::string(kContactsAdvice)});
  std::ranges::copy(variance, coefficients.begin());
  joint.detector.factor = object.number("factor");
  return joint;
}

}  // namespace

ContactDetector::Settings ContactsFile::settings() const {
  ContactDetector::Settings settings;
  settings.joints.reserve(joints.size());
  for (const Joint& joint : joints) settings.joints.push_back(joint.detector);
  return settings;
}

double supported_rate_per_hour(double hours) noexcept { return kEventsOfNone / hours; }

void save_contacts(const std::filesystem::path& path, const ContactsFile& file) {
  const ContactDetector detector(file.settings(), kContactCheckRate_Hz);
  nlohmann::ordered_json document;
  document["format"] = kContactsFormat;
  document["format_version"] = kContactsFormatVersion;
  document["torsio_version"] = kVersion;
  document["arm"] = file.arm;
  document["payload_kg"] = file.payload_kg;
  document["observer_rad_s"] = file.bandwidth_rad_s;
  document["hours"] = file.hours;
  document["false_alarms_per_hour"] = file.false_alarms_per_hour;
  document["upper_bound_per_hour"] = file.upper_bound_per_hour;
  document["joints"] = nlohmann::ordered_json::array();
  for (const ContactsFile::Joint& joint : file.joints)
    document["joints"].push_back({{"joint", joint.name},
                                  {"variance", joint.detector.error.coefficients},
                                  {"factor", joint.detector.factor}});
  const std::string text =
      document.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  write_whole_file(path, std::as_bytes(std::span(text)));
}

ContactsFile read_contacts(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path, kMaxContactsBytes);
  return parse_contacts({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.string());
}

ContactsFile parse_contacts(std::string_view text, const std::string& place) {
  const nlohmann::json parsed = parse_json(text, place, kContactsAdvice);
  const JsonObject document(parsed, place, kContactsAdvice);
  if (!document.has("format") || document.text("format") != kContactsFormat)
    throw Error({.place = place,
                 .expected = "a file of contacts, as torsio arm learn-contacts writes it",
                 .found = "another JSON document"});
  const std::uint64_t version = document.whole_number("format_version");
  if (version != kContactsFormatVersion)
    throw Error(
        {.place = place + "/format_version",
         .expected = fmt::format("{}, which torsio {} reads", kContactsFormatVersion, kVersion),
         .found = fmt::format("{}", version)});
  document.allow_only({"format", "format_version", "torsio_version", "arm", "payload_kg",
                       "observer_rad_s", "hours", "false_alarms_per_hour", "upper_bound_per_hour",
                       "joints"});
  ContactsFile file{.arm = document.text("arm"),
                    .payload_kg = document.number("payload_kg"),
                    .bandwidth_rad_s = positive(document, "observer_rad_s", place)};
  file.hours = positive(document, "hours", place);
  file.false_alarms_per_hour = positive(document, "false_alarms_per_hour", place);
  file.upper_bound_per_hour = positive(document, "upper_bound_per_hour", place);
  if (!(file.payload_kg >= 0.0))
    throw Error({.place = place + "/payload_kg", .expected = "a mass of 0 kg or more"});
  const double supported = supported_rate_per_hour(file.hours);
  for (const auto& [key, rate] : {std::pair{"false_alarms_per_hour", file.false_alarms_per_hour},
                                  std::pair{"upper_bound_per_hour", file.upper_bound_per_hour}})
    if (rate < supported * (1.0 - 1e-6))
      throw Error({.place = fmt::format("{}/{}", place, key),
                   .expected = fmt::format("at least {:.3g} per hour, which {:g} hours support",
                                           supported, file.hours),
                   .found = fmt::format("{:.3g}", rate),
                   .advice = std::string(kContactsAdvice)});
  file.joints = document.objects(
      "joints", [&](const JsonObject& joint) { return contacts_joint(joint, place + "/joints"); });
  try {
    const ContactDetector detector(file.settings(), kContactCheckRate_Hz);
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place = fmt::format("{}/joints: {}", place, report.place);
    report.advice = kContactsAdvice;
    throw Error(std::move(report));
  }
  return file;
}

void require_contacts_of(const ContactsFile& file, const ArmModel& arm, double bandwidth_rad_s,
                         const std::string& place) {
  constexpr auto kAdvice =
      "The thresholds hold for the arm, payload and observer with which they were learned: learn "
      "them again.";
  const auto check = [&](bool holds, const char* key, std::string expected, std::string found) {
    if (!holds)
      throw Error({.place = fmt::format("{}/{}", place, key),
                   .expected = std::move(expected),
                   .found = std::move(found),
                   .advice = kAdvice});
  };
  check(file.arm == arm.name, "arm", fmt::format("'{}'", arm.name), fmt::format("'{}'", file.arm));
  check(std::abs(file.payload_kg - arm.payload.mass_kg) <= kSamePayload_kg, "payload_kg",
        fmt::format("{:g}, the payload of the arm", arm.payload.mass_kg),
        fmt::format("{:g}", file.payload_kg));
  check(std::abs(file.bandwidth_rad_s / bandwidth_rad_s - 1.0) <= kRateRounding, "observer_rad_s",
        fmt::format("{:g}", bandwidth_rad_s), fmt::format("{:g}", file.bandwidth_rad_s));
  check(file.joints.size() == arm.joints.size(), "joints",
        fmt::format("{} joints", arm.joints.size()), fmt::format("{}", file.joints.size()));
  for (std::size_t j = 0; j < arm.joints.size(); ++j)
    check(file.joints[j].name == arm.joints[j].name, "joints",
          fmt::format("'{}' as joint {}", arm.joints[j].name, j + 1),
          fmt::format("'{}'", file.joints[j].name));
}

}  // namespace torsio
