#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "data/csv/csv_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace {

constexpr std::string_view kLog =
    "t_s,pos_deg,tau,run\n0,1,2,0\n0.1,2,3,0\n0.2,3,,0\n0.3,4,5,1\n0.4,5,6,1\n0.5,6,7,1\n";

void apply(const torsio::Mapping& mapping) {
  torsio::LogTable table = torsio::parse_csv(kLog, "log.csv", {.skip = mapping.drop});
  for (torsio::Recording& recording : torsio::measured_recordings(std::move(table), mapping))
    torsio::add_derived(recording, mapping.derive);
}

}  // namespace

/// Any text is a mapping that can be applied to a log, a manifest, or an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const torsio::Mapping mapping = torsio::parse_mapping(text, "fuzz.yaml");
    // A rate near the limit of samples would only fill the memory.
    constexpr double kFastest = 1e5;
    if (mapping.clock.resample_Hz < kFastest) apply(mapping);
  } catch (const torsio::Error&) {
  }
  try {
    static_cast<void>(torsio::parse_manifest(text, "fuzz.yaml"));
  } catch (const torsio::Error&) {
  }
  return 0;
}
