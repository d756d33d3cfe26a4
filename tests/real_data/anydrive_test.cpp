// The released LSTM of the ANYdrive joint against the outputs that PyTorch gave (float32) on five
// input sequences.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "real_data/real_data.hpp"
#include "support/each_instruction_set.hpp"
#include "support/network_reference.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

/// All recordings are in one folder.
std::string anydrive(const std::string& file) {
  return data_folder(read_manifest(manifest_path("desr_dualcam"))) + "/anydrive_lstm/" + file;
}

ImportedModel imported(bool fold_biases = false) {
  const ForeignFile file = read_foreign_file(anydrive("weights.json"));
  ImportOptions options;
  options.features.inputs = {"joint_target_rad - joint_angle_rad", "joint_speed_rad_s"};
  options.sample_rate_Hz = 200.0;
  options.fold_biases = fold_biases;
  return import_network(parse_weights_json(file.bytes, file.source.file), file.source, options);
}

struct Deviation {
  double streaming = 0.0;  ///< deviation of the float32 step from PyTorch's float32
  double exact =
      0.0;  ///< deviation of the imported numbers, evaluated in double, from PyTorch's float32
};

Deviation deviation(bool fold_biases = false) {
  const auto parameters = imported(fold_biases).file.parameters.get<Lstm::Parameters>();
  const auto vectors = nlohmann::json::parse(std::ifstream(anydrive("test_vectors.json")));
  Deviation worst;
  for (const auto& sequence : vectors) {
    Lstm lstm(parameters);
    test::NetworkReference<Lstm> reference(parameters);
    for (std::size_t n = 0; n < sequence.at("x").size(); ++n) {
      const auto x = sequence.at("x")[n].get<std::vector<double>>();
      const double expected = sequence.at("y_Nm")[n];
      worst.streaming = std::max(worst.streaming, std::abs(lstm.step(x).value - expected));
      worst.exact = std::max(worst.exact, std::abs(reference.step(x) - expected));
    }
  }
  return worst;
}

TEST(Anydrive, IsImportedWithoutLoss) {
  TORSIO_NEEDS_DATA("desr_dualcam");
  const auto parameters = imported().file.parameters.get<Lstm::Parameters>();
  EXPECT_EQ(parameters.scaling.inputs.scale, (std::vector<double>{0.5, 4.0}));
  EXPECT_EQ(parameters.scaling.target_scale, 20.0);
  // PyTorch's own rounding: what an evaluation without any is away from it.
  EXPECT_LT(deviation().exact, 1.3e-5);
}

TEST(Anydrive, StreamsTheOutputOfPyTorch) {
  TORSIO_NEEDS_DATA("desr_dualcam");
  test::on_each_instruction_set([](const char* name) {
    // Those before AVX2 have no fused multiply-adds: the sums round otherwise.
    const bool fuses =
        !std::string_view(name).starts_with("S") && name != std::string_view("EMU128");
    EXPECT_LT(deviation().streaming, fuses ? 1e-5 : 3e-5) << name;
  });
}

TEST(Anydrive, RoundsOtherwiseWithItsBiasesInOne) {
  TORSIO_NEEDS_DATA("desr_dualcam");
  test::on_each_instruction_set(
      [](const char* name) { EXPECT_LT(deviation(true).streaming, 3e-5) << name; });
}

}  // namespace
}  // namespace torsio
