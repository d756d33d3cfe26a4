#include "torsio/core/progress.hpp"

#include "core/report_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {

void report_progress(const Progress& progress, double fraction, std::string_view doing) {
  if (progress && !progress(fraction, doing)) throw Cancelled();
}

}  // namespace torsio
