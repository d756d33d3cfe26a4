#include "recordings/check_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/output.hpp"
#include "torsio/core/error.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace {

std::vector<torsio::Recording> training_recordings(const torsio::Dataset& dataset) {
  std::vector<torsio::Recording> recordings;
  for (const torsio::DatasetRecord& record : dataset.records)
    if (record.has_role(torsio::Role::train)) recordings.push_back(record.recording);
  return recordings;
}

torsio::DriveTerms usual_terms(torsio::DriveLaw law) {
  using enum torsio::DriveTerm;
  torsio::DriveTerms terms =
      torsio::drive_terms({base, delay, load_friction, load_stribeck, stribeck});
  if (law == torsio::DriveLaw::position || law == torsio::DriveLaw::voltage)
    terms |= torsio::drive_terms({resistance_rise, duty_exponent});
  return terms;
}

}  // namespace

bool lacks_deflection(const torsio::Dataset& dataset) {
  return std::ranges::none_of(dataset.records, [](const torsio::DatasetRecord& record) {
    const torsio::Recording& recording = record.recording;
    return recording.has("spring_deflection_rad") ||
           (recording.has("gear_angle_rad") && recording.has("joint_angle_rad"));
  });
}

std::optional<torsio::DriveSheet> law_to_check(const torsio::Dataset& dataset,
                                               const std::string& drive_file, bool wants_advice) {
  if (!drive_file.empty()) return torsio::read_drive_sheet(drive_file);
  if (dataset.records.empty()) return std::nullopt;
  try {
    return torsio::assumed_drive_sheet(dataset.records.front().recording);
  } catch (const torsio::Error& error) {
    // Recordings with a deflection are those of a spring alone.
    if (wants_advice && lacks_deflection(dataset))
      remark(fmt::format("note: there is no advice on a drive: {}", error.what()));
    return std::nullopt;
  }
}

CheckedDrive checked_drive(const torsio::Dataset& dataset, const std::string& load_file,
                           const torsio::DriveSheet& drive, std::size_t threads,
                           const torsio::Progress& progress) {
  const torsio::LoadSheet load = torsio::read_load_sheet(load_file);
  const std::vector<torsio::Recording> recordings = training_recordings(dataset);
  double duration_s = 0.0;
  for (const torsio::Recording& recording : recordings)
    duration_s += static_cast<double>(recording.size()) / recording.sample_rate_Hz();
  remark(
      fmt::format("note: the drive is identified for the advice on it ({} recordings of together "
                  "{:.0f} s, law '{}'), which takes seconds for a minute of recordings",
                  recordings.size(), duration_s, torsio::name(drive.law)));
  const torsio::DriveIdentification identified =
      torsio::identify_drive(recordings, load, drive,
                             {.terms = usual_terms(drive.law),
                              .starts = 1,
                              .has_standard_errors = false,
                              .threads = threads,
                              .progress = progress});
  CheckedDrive checked{.findings = {}, .advice = torsio::advise_drive(identified, recordings)};
  for (const torsio::DriveFinding& finding : identified.findings)
    checked.findings.push_back({finding.is_failure ? torsio::Verdict::fail : torsio::Verdict::warn,
                                "drive", "", finding.subject + ": " + finding.text, ""});
  return checked;
}
