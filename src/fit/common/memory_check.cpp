#include "fit/common/memory_check.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {

void require_memory(const MemoryNeed& need) {
  const double have =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (need.bytes <= have) return;
  const std::string problem = fmt::format("{} would not fit into this machine's memory", need.what);
  const std::string takes = fmt::format("about {:.1f} GB", need.bytes * 1e-9);
  if (need.count == 0)
    throw Error({.problem = problem,
                 .expected = fmt::format("at most {:.1f} GB", have * 1e-9),
                 .found = takes,
                 .advice = need.advice});
  const auto fits = static_cast<std::size_t>(static_cast<double>(need.count) *
                                             std::pow(have / need.bytes, 1.0 / need.growth));
  throw Error({.problem = problem,
               .expected = fmt::format("at most {} {}", fits, need.counted),
               .found = fmt::format("{}, which take {}", need.count, takes),
               .advice = fmt::format(fmt::runtime(need.advice), fits)});
}

}  // namespace torsio
