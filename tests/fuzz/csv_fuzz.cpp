#include <cstddef>
#include <cstdint>
#include <string_view>

#include "data/csv/csv_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

/// Any bytes, plain or gzipped, are a recording or an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const torsio::CsvOptions options{.skip = {},
                                   .limits = {.line_bytes = 1 << 16, .values = 1 << 16}};
  constexpr double kRateHz = 100.0;
  try {
    static_cast<void>(torsio::measured_recordings(torsio::parse_csv(bytes, "fuzz.csv", options),
                                                  torsio::Mapping{}, kRateHz));
  } catch (const torsio::Error&) {
    return 0;
  }
  return 0;
}
