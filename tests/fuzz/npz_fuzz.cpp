#include <cstddef>
#include <cstdint>
#include <string_view>

#include "data/arrays/npz.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

/// Any bytes, and any damaged archive of arrays, are columns or an Error within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto source =
      torsio::bytes_in_memory({reinterpret_cast<const char*>(data), size}, "fuzz.npz");
  torsio::fuzz::within_budget([&] {
    try {
      static_cast<void>(
          torsio::table_of_arrays(torsio::read_npz(*source, "fuzz.npz"), "fuzz.npz", {}));
    } catch (const torsio::Error&) {
      return;
    }
  });
  return 0;
}
