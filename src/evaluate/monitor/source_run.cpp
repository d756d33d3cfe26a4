#include "evaluate/monitor/source_run.hpp"

#include <utility>

#include "torsio/core/realtime.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio {

std::vector<SourceRun> run_sources(const std::vector<Estimator>& sources,
                                   const Recording& recording) {
  std::vector<SourceRun> runs;
  for (const Estimator& source : sources) {
    const std::string& target = source.settings().target;
    const EstimatedRecording estimated = estimate_recording(source, recording);
    SourceRun run{.value_Nm = estimated.channels.channel(estimate_channel(target)).values,
                  .std_dev_Nm = estimated.channels.channel(error_bar_channel(target)).values};
    for (std::size_t n = 0; n < run.value_Nm.size(); ++n) {
      const Fault fault = estimated.faults[n];
      if (fault == Fault::none) continue;
      run.std_dev_Nm[n] = kNotMeasured;
      if (fault != Fault::warming_up) ++run.guarded;
    }
    runs.push_back(std::move(run));
  }
  return runs;
}

}  // namespace torsio
