#include <utility>

#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {

Dataset sweep_dataset(std::string_view actuator, std::uint64_t seed, const Progress& progress) {
  return sweep_dataset(data_sheet(actuator), seed, progress);
}

Dataset sweep_dataset(const DataSheet& sheet, std::uint64_t seed, const Progress& progress) {
  const SweepProtocol protocol = sweep_protocol(sheet);
  Dataset dataset;
  const auto record = [&](double lever_m, double inclination_rad, Role role) {
    Recording sweep = simulate(sheet,
                               {.experiment = "sweep",
                                .seed = seed + dataset.records.size(),
                                .lever_m = lever_m,
                                .inclination_rad = inclination_rad},
                               progress);
    const std::size_t samples = sweep.size();
    dataset.records.push_back({std::move(sweep), whole_record(samples, role)});
  };
  for (const double lever_m : protocol.train_lever_m) record(lever_m, 0.0, Role::train);
  record(protocol.test_lever_m, protocol.test_inclination_rad, Role::test);
  return dataset;
}

}  // namespace torsio
