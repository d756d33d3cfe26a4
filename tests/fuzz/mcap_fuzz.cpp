#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "data/mapping/measured_recordings.hpp"
#include "data/mcap/mcap_records.hpp"
#include "data/ros/message_topics.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

namespace {

void read(std::string_view bytes) {
  const auto source = torsio::bytes_in_memory(bytes, "fuzz.mcap");
  constexpr double kRateHz = 100.0;
  try {
    torsio::McapRecords records(*source, "fuzz.mcap", {.record_bytes = 1 << 20, .channels = 64});
    const std::vector<torsio::NamedMessages> files{{"fuzz.mcap", &records}};
    static_cast<void>(torsio::measured_recordings(
        torsio::table_of_messages(files, "fuzz.mcap", {.values = 1 << 16}), torsio::Mapping{},
        kRateHz));
  } catch (const torsio::Error&) {
    return;
  }
}

}  // namespace

/// Any bytes, and any damaged file of a recorder, are a recording or an Error within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  torsio::fuzz::within_budget([&] { read({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
