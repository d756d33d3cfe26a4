#include "data/read_budget.hpp"

#include <fmt/format.h>

#include "core/report_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::uint64_t kReportEvery = 1'000'000;

}  // namespace

void ReadBudget::report() {
  next_report_ = worked_ + kReportEvery;
  report_progress(progress_, 0.0, "reading");
  if (worked_ <= kWork + kWorkPerByte * read_) return;
  throw Error({.place = name_,
               .problem = fmt::format("its {} bytes describe more than {} elements", read_,
                                      kWork + kWorkPerByte * read_),
               .advice = "The file is damaged, or was made to use up a machine."});
}

void ReadBudget::refuse_memory() const {
  throw Error({.place = name_,
               .problem = fmt::format("its {} bytes describe more than {} MB of memory", read_,
                                      memory_limit() >> 20U),
               .advice =
                   "The file is damaged, or was made to use up a machine; of a recording with many "
                   "topics, name those that are needed in a mapping."});
}

}  // namespace torsio
