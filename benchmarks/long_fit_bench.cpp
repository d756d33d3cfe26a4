#include <fmt/format.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "rows.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/write.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::bench {

// As `torsio fit`: files, features, search of the structure, residual, guards. Each recording has 85 000
// samples; the threads are those of the machine.
Row grey_box_fit_files() {
  std::vector<std::string> files;
  std::size_t samples = 0;
  for (const std::size_t seed : {1, 2, 3, 4}) {
    const Recording recording =
        simulate({.actuator = "dfki-50", .experiment = "sweep", .seed = seed});
    samples += recording.size();
    files.push_back((scratch_folder() / fmt::format("sweep_{}.csv", seed)).string());
    write_csv(recording, files.back());
  }
  const double seconds = best_seconds(
      [&] {
        const Dataset dataset = load_dataset(files, {});
        const TrainedModel trained = train_model(
            dataset, {.family = "grey_box", .features = resolve_inputs(dataset, {})}, 1);
        if (trained.file.settings.features.inputs.empty())
          throw std::runtime_error("grey_box_fit_files: the model has no inputs");
      },
      0.0, 3);
  return {.value = 1e-6 * static_cast<double>(samples) / seconds, .unit = "Msamples/s"};
}

}  // namespace torsio::bench
