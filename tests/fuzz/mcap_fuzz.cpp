#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "data/mcap/mcap_table.hpp"
#include "data/measured_recordings.hpp"
#include "torsio/core/error.hpp"

namespace {

/// Whether the bytes are a recording, and not an Error.
bool is_read(std::string_view bytes) {
  const torsio::McapOptions options{
      .wanted = {}, .limits = {.record_bytes = 1 << 20, .channels = 64}, .values = 1 << 16};
  const auto source = torsio::bytes_in_memory(bytes, "fuzz.mcap");
  const std::vector<torsio::NamedBytes> files{{"fuzz.mcap", source.get()}};
  constexpr double kRateHz = 100.0;
  try {
    static_cast<void>(torsio::measured_recordings(torsio::read_mcap(files, "fuzz.mcap", options),
                                                  torsio::Mapping{}, kRateHz));
    return true;
  } catch (const torsio::Error&) {
    return false;
  }
}

}  // namespace

/// Any bytes, and any damaged file of a recorder, are a recording or an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(is_read({reinterpret_cast<const char*>(data), size}));
  return 0;
}
