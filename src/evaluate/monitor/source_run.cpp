#include "evaluate/monitor/source_run.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "data/recording_rows.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

void take_zeros(TorqueSources& sources, const Recording& recording) {
  for (const ZeroRule& zero : recording.zeros)
    if (std::ranges::find(sources.raw_inputs(), zero.channel) != sources.raw_inputs().end())
      sources.set_zero(zero.channel, 0.0);
}

PartSet parts_of_all(const Redundancy& redundancy) {
  PartSet of_all = ~PartSet{0};
  for (std::size_t i = 0; i < redundancy.settings().sources.size(); ++i)
    of_all &= redundancy.parts_of(i);
  return of_all;
}

std::vector<SourceRun> run_sources(TorqueSources sources, const Recording& recording) {
  take_zeros(sources, recording);
  RecordingRows rows(recording, sources.raw_inputs());
  std::vector<SourceRun> runs(sources.size());
  for (SourceRun& run : runs) {
    run.value_Nm.reserve(recording.size());
    run.std_dev_Nm.reserve(recording.size());
  }
  const DenormalsOff denormals_off;
  sources.reset();
  for (std::size_t n = 0; n < recording.size(); ++n) {
    const std::span<const Estimate> estimates = sources.step(rows.at(n));
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const Fault fault = estimates[i].fault;
      runs[i].value_Nm.push_back(estimates[i].value);
      runs[i].std_dev_Nm.push_back(fault == Fault::none ? estimates[i].std_dev : kNotMeasured);
      if (fault != Fault::none && fault != Fault::warming_up) ++runs[i].guarded[fault];
    }
  }
  return runs;
}

}  // namespace torsio
