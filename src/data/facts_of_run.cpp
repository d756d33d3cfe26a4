#include "data/facts_of_run.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <map>

#include "data/names.hpp"

namespace torsio {

void use_rate_of_format(LogTable& table, Mapping& mapping, double rate_Hz) {
  const ClockRule& clock = mapping.clock;
  const bool is_stated = clock.rebuild || clock.resample_Hz > 0.0 || mapping.rate_Hz > 0.0;
  if (!(table.resample_Hz > 0.0) || is_stated) return;
  mapping.clock.resample_Hz = rate_Hz > 0.0 ? rate_Hz : table.resample_Hz;
  table.notes.push_back(fmt::format(
      "uneven time stamps are interpolated onto {:g} Hz, from the first one on; --rate, or "
      "clock: of a mapping, gives another rate",
      mapping.clock.resample_Hz));
}

void add_conditions(Recording& recording, const ManifestFile& entry,
                    const std::vector<std::pair<std::string, double>>& of_file) {
  for (const auto& [name, value] : entry.conditions) recording.add_condition(name, value);
  for (const auto& [name, value] : of_file)
    if (!recording.has(name)) recording.add_condition(name, value);
}

void name_twins_by_file(std::vector<DatasetRecord>& records) {
  std::map<std::string, std::size_t> met;
  for (const DatasetRecord& record : records) ++met[record.recording.name()];
  for (DatasetRecord& record : records) {
    Recording& recording = record.recording;
    const std::string stem = file_stem(recording.source.file);
    // Only what a file states about its run gives two files one name.
    if (recording.labels.empty() || met[recording.name()] == 1 ||
        recording.name().find(stem) != std::string::npos)
      continue;
    recording.rename(fmt::format("{}_{}", recording.name(), stem));
  }
}

}  // namespace torsio
