#include <cstddef>
#include <cstdlib>
#include <string_view>

#include "torsio/arm/arm_model.hpp"
#include "torsio/arm/urdf.hpp"
#include "torsio/core/error.hpp"

// Any text must either be refused with an Error or give an arm that can be.

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    torsio::require_possible(torsio::read_urdf(text, "r.urdf"));
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
