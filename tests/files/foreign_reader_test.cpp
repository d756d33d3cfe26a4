#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "model/network/lstm.hpp"
#include "support/example_model_file.hpp"
#include "support/examples/linear.hpp"
#include "support/random_network.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

constexpr const char* kPython = "/usr/bin/python3";

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 256> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return text;
}

TEST(ForeignReader, OpensAModelFile) {
  if (!std::filesystem::exists(kPython)) GTEST_SKIP() << "no " << kPython;
  const TemporaryFolder folder;
  save_model(folder.path("m.safetensors"),
             test::example_model_file(test::example<LinearCoulomb>()));
  const auto read = [&](const std::string& tensor) {
    return output_of(std::string(kPython) + " '" TORSIO_FOREIGN_READER "' '" +
                     folder.path("m.safetensors") + "' " + tensor);
  };
  EXPECT_EQ(read("model.coefficients.values"),
            "[3, 4] [0.5, 600.0, 0.0, 1.5, 0.4, 620.0, 0.0, 1.2, 0.3, 700.0, 0.0, 1.4] "
            "linear_coulomb\n");
  EXPECT_EQ(read("model.rate_scale"), "[] [0.05] linear_coulomb\n");
  EXPECT_EQ(read("model.rate_feature"), "[] [1] linear_coulomb\n");
  EXPECT_EQ(read("model.coefficients.scheduled"), "[] [1] linear_coulomb\n");

  auto network = test::random_network<Lstm>({.units = {5, 3}}, 5);
  network.layers[1].bias.assign(12, 0.25F);
  save_model(folder.path("m.safetensors"), test::example_model_file(Lstm(network)));
  EXPECT_EQ(read("model.layers.1.bias"),
            "[12] [0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25] lstm\n");
}

}  // namespace
}  // namespace torsio
