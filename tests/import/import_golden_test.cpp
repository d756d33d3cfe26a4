// Networks of other programs against PyTorch (tests/golden/make_import_oracles.py).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "import/read_network.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

using Json = nlohmann::json;

std::vector<Json> cases() {
  std::ifstream file(std::string(TORSIO_GOLDEN_IMPORT) + "/cases.json");
  if (!file) throw std::runtime_error("cases.json is missing: ./run oracles writes it");
  std::vector<Json> all = Json::parse(file);
  if (!test::can_read_onnx())
    std::erase_if(
        all, [](const Json& one) { return one.at("file").get<std::string>().ends_with(".onnx"); });
  return all;
}

ImportedModel imported(const Json& one) {
  const std::string path =
      std::string(TORSIO_GOLDEN_IMPORT) + "/" + one.at("file").get<std::string>();
  const ForeignFile file = read_foreign_file(path);
  ImportOptions options;
  options.sample_rate_Hz = 200.0;
  for (std::size_t j = 0; j < one.at("input_count"); ++j)
    options.features.inputs.push_back("input_" + std::to_string(j) + "_1");
  return import_network(test::read_network(file, one.value("activation", "linear")), file.source,
                        options);
}

std::size_t warm_up(const AnyModel::Parameters& parameters) {
  if (const auto* const lstm = parameters.get_if<Lstm::Parameters>()) return lstm->warm_up_samples;
  const auto* const gru = parameters.get_if<Gru::Parameters>();
  return gru == nullptr ? 0 : gru->warm_up_samples;
}

class ImportGolden : public testing::TestWithParam<Json> {};

TEST_P(ImportGolden, StreamsTheOutputOfPyTorch) {
  const Json& one = GetParam();
  const ImportedModel import = imported(one);
  EXPECT_EQ(import.file.parameters.family(), one.at("family"));
  EXPECT_EQ(warm_up(import.file.parameters), one.value("window", std::size_t{0}));
  AnyModel model(import.file.parameters);
  const auto inputs = one.at("inputs").get<std::vector<double>>();
  const auto outputs = one.at("outputs").get<std::vector<double>>();
  ASSERT_EQ(inputs.size(), outputs.size() * model.input_count());
  double size = 1.0;
  for (const double output : outputs) size = std::max(size, std::abs(output));
  for (std::size_t n = 0; n < outputs.size(); ++n) {
    const Estimate estimate =
        model.step(std::span(inputs).subspan(n * model.input_count(), model.input_count()));
    // Weights, sums and activations are float32: a few units in the last place of the largest
    // value.
    EXPECT_NEAR(estimate.value, outputs[n], 2e-6 * size) << "sample " << n;
  }
}

TEST_P(ImportGolden, HasTheSameOutputFromItsModelFile) {
  const ImportedModel import = imported(GetParam());
  const auto bytes = model_bytes(import.file);
  EXPECT_EQ(model_bytes(parse_model(bytes, "again")), bytes);
}

INSTANTIATE_TEST_SUITE_P(Networks, ImportGolden, testing::ValuesIn(cases()),
                         [](const auto& instance) {
                           std::string name = instance.param.at("file");
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace torsio
