// libtorsio.so as foreign programs see it: each caller is a process of its own.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "support/example_model_file.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/network.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/random.hpp"

namespace torsio::test {
namespace {

constexpr std::size_t kRows = 3000;

struct Outcome {
  int exit_code = -1;
  std::string out;
};

Outcome shell(const std::string& command) {
  Outcome outcome;
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> text{};
  while (std::fgets(text.data(), text.size(), pipe) != nullptr) outcome.out += text.data();
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

/// Rows of two channels with missing samples, jumps and excursions.
std::vector<std::array<double, 2>> rows() {
  Random random(5);
  std::vector<std::array<double, 2>> all;
  for (std::size_t n = 0; n < kRows; ++n) {
    const double t = static_cast<double>(n);
    std::array row{0.8 * std::sin(0.001 * t) + 1e-4 * random.normal(), 0.02};
    if (random.uniform() < 0.01) row[0] = std::numeric_limits<double>::quiet_NaN();
    if (random.uniform() < 0.005) row[0] += 2.0;
    all.push_back(row);
  }
  return all;
}

std::string text_of(const std::vector<std::array<double, 2>>& rows) {
  std::ostringstream text;
  text.precision(17);
  for (const auto& row : rows) text << row[0] << ' ' << row[1] << '\n';
  return text.str();
}

/// One that recovers within the rows.
ModelFile quick(ModelFile file) {
  file.settings.disturbances.warm_up_s = 0.05;
  return file;
}

class ForeignCaller : public testing::TestWithParam<ModelFile> {
 protected:
  void SetUp() override {
    save_model(model_, GetParam());
    folder_.file("rows.txt", text_of(rows()));
  }
  TemporaryFolder folder_;
  std::string model_ = folder_.path("joint.safetensors");
  std::string input_ = folder_.path("rows.txt");
};

TEST_P(ForeignCaller, OfC99GetsTheNumbersOfTheCppLibraryAndIsRefusedWrongCalls) {
  Estimator expected = make_estimator(GetParam());
  expected.set_zero("joint_angle_rad", 0.02);
  const Outcome outcome =
      shell(std::string(TORSIO_SMOKE) + " '" + model_ + "' < '" + input_ + "' 2>&1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out.substr(0, 2000);
  int usable = 0;
  std::istringstream lines(outcome.out);
  for (const auto& row : rows()) {
    double value = 0.0;
    int fault = -1;
    ASSERT_TRUE(lines >> value >> fault);
    const Estimate estimate = expected.step(row);
    ASSERT_EQ(value, estimate.value);
    ASSERT_EQ(fault, static_cast<int>(estimate.fault));
    usable += fault == 0 ? 1 : 0;
  }
  EXPECT_GT(usable, 500);
}

TEST_P(ForeignCaller, OfPythonByCtypesGetsTheNumbersOfTheCppLibrary) {
  if (std::string(TORSIO_PYTHON).empty()) GTEST_SKIP() << "no Python 3 was found";
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer's library must come first in the process";
#endif
  Estimator expected = make_estimator(GetParam());
  expected.set_zero("joint_angle_rad", 0.0);
  const Outcome outcome = shell(std::string(TORSIO_PYTHON) + " " + TORSIO_EXAMPLES +
                                "/04_estimate_torque_by_ctypes.py " + TORSIO_LIBRARY + " '" +
                                model_ + "' < '" + input_ + "' 2>&1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out.substr(0, 2000);
  std::istringstream lines(outcome.out);
  for (const auto& row : rows()) {
    std::string value;
    std::string std_dev;
    std::string fault;
    ASSERT_TRUE(lines >> value >> std_dev >> fault);
    const Estimate estimate = expected.step(row);
    ASSERT_EQ(std::strtod(value.c_str(), nullptr), estimate.value);
    ASSERT_EQ(fault, name(estimate.fault));
  }
}

#ifdef TORSIO_C_EXAMPLE
TEST_P(ForeignCaller, CanBeTheExample) {
  const Outcome outcome = shell(std::string(TORSIO_C_EXAMPLE) + " '" + model_ + "' 2>&1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out;
  EXPECT_NE(outcome.out.find("torque_Nm"), std::string::npos) << outcome.out;
  EXPECT_NE(shell(std::string(TORSIO_C_EXAMPLE) + " nothing.safetensors 2>&1").exit_code, 0);
}
#endif

INSTANTIATE_TEST_SUITE_P(Models, ForeignCaller,
                         testing::Values(quick(example_model_file(example<GreyBox>())),
                                         quick(example_model_file(example<Lstm>()))),
                         [](const auto& of) { return std::string(of.param.parameters.family()); });

TEST(CLibrary, ExportsNothingButItsInterface) {
  const Outcome outcome =
      shell(std::string(TORSIO_NM) + " -D --defined-only " + TORSIO_LIBRARY + " 2>&1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out;
  std::istringstream lines(outcome.out);
  std::string address;
  std::string kind;
  std::string symbol;
  std::size_t functions = 0;
  while (lines >> address >> kind >> symbol) {
    EXPECT_EQ(kind, "T") << symbol;
    EXPECT_EQ(symbol.rfind("torsio_", 0), 0U) << symbol;
    ++functions;
  }
  EXPECT_GE(functions, 20U);
}

TEST(CLibrary, HasTheSonameOfItsAbi) {
  EXPECT_NE(shell(std::string("readelf -d ") + TORSIO_LIBRARY).out.find("[libtorsio.so.1]"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio::test
