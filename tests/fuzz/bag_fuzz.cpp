#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "data/bag/bag_records.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "data/ros/message_topics.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

/// Any bytes, and any damaged bag of ROS 1, are a recording or an Error within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr double kRateHz = 100.0;
  const auto source =
      torsio::bytes_in_memory({reinterpret_cast<const char*>(data), size}, "fuzz.bag");
  torsio::fuzz::within_budget([&] {
    try {
      torsio::BagRecords records(*source, "fuzz.bag", {.record_bytes = 1 << 20, .connections = 64});
      const std::vector<torsio::NamedMessages> files{{"fuzz.bag", &records}};
      static_cast<void>(torsio::measured_recordings(
          torsio::table_of_messages(files, "fuzz.bag", {.values = 1 << 16}), torsio::Mapping{},
          kRateHz));
    } catch (const torsio::Error&) {
      return;
    }
  });
  return 0;
}
