#include <cstddef>
#include <cstdint>
#include <span>

#include "torsio/core/error.hpp"
#include "torsio/data/recording_blocks.hpp"

/// Any bytes are a recorder's file or an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(
        torsio::parse_recording_blocks(std::as_bytes(std::span(data, size)), "fuzz.tsr"));
  } catch (const torsio::Error&) {
    return 0;
  }
  return 0;
}
