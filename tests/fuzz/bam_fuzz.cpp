#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "data/bam/bam_log.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

/// Any bytes are a table of equal columns or an Error within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto source =
      torsio::bytes_in_memory({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  torsio::fuzz::within_budget([&] {
    try {
      const torsio::LogTable table = torsio::read_bam_log(*source, "fuzz.json");
      for (const torsio::LogColumn& column : table.columns)
        if (column.values.size() != table.rows()) std::abort();
    } catch (const torsio::Error&) {
      return;
    }
  });
  return 0;
}
