// Pages stay small enough to be sent, whatever the length of the recording.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "torsio/evaluate/comparison.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

TEST(ReportSize, OfAComparisonOnTheDemoIsAtMostThreeMegabytes) {
  const Dataset dataset = sweep_dataset("dfki-50", 1, {});
  const auto choices = model_choices(dataset, "linear,linear_coulomb,polynomial,maxwell_slip", {});
  const Comparison comparison = compare(dataset, choices, 1, false);
  EXPECT_EQ(comparison.models.size(), 4U);
  const std::string page = report_html(comparison_report(comparison, dataset));
  EXPECT_LE(page.size(), 3'000'000U);
  EXPECT_NE(page.find("Pareto front"), std::string::npos);
}

TEST(ReportSize, OfTenMillionSamplesIsAtMostTwentyFiveMegabytes) {
  constexpr std::size_t kSamples = 10'000'000;
  Recording recording("long", 1000.0);
  std::vector<double> deflection(kSamples);
  std::vector<double> torque(kSamples);
  for (std::size_t n = 0; n < kSamples; ++n) {
    deflection[n] = 0.05 * std::sin(1e-3 * static_cast<double>(n));
    torque[n] = 1000.0 * deflection[n] + std::cos(0.3 * static_cast<double>(n % 1000));
  }
  recording.add({"spring_deflection_rad", deflection});
  recording.add({"torque_Nm", std::move(torque)});
  const std::string page = report_html(simulation_report(recording, deflection, "long"));
  EXPECT_LE(page.size(), 25'000'000U);
  EXPECT_GT(page.size(), 1'000'000U);
}

}  // namespace
}  // namespace torsio
