#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "real_data/real_data.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

std::size_t samples_with(const Dataset& dataset, Role role) {
  std::size_t samples = 0;
  for (const DatasetRecord& record : dataset.records)
    for (const Segment& segment : record.segments)
      if (segment.role == role) samples += segment.end - segment.begin;
  return samples;
}

void expect_finite(const Dataset& dataset) {
  for (const DatasetRecord& record : dataset.records)
    for (const Channel& channel : record.recording.channels())
      EXPECT_TRUE(std::ranges::all_of(channel.values, [](double v) { return std::isfinite(v); }))
          << record.recording.name() << " " << channel.name;
}

TEST(DesrFoot, DualCamTrainsOnFourSupportsAndTestsTwo) {
  TORSIO_NEEDS_DATA("desr_dualcam");
  const Dataset dataset = load_dataset({manifest_path("desr_dualcam")}, {});
  ASSERT_EQ(dataset.records.size(), 6U);
  EXPECT_EQ(dataset.sample_rate_Hz(), 1.0 / 0.0012);
  EXPECT_EQ(samples_with(dataset, Role::train), 4U * 12000U);
  EXPECT_EQ(samples_with(dataset, Role::test), 2U * 12000U);
  const Recording& last = dataset.records.back().recording;
  EXPECT_EQ(last.name(), "dualcam_x35");
  EXPECT_EQ(last.conditions(), std::vector<std::string>{"support_m"});
  EXPECT_DOUBLE_EQ(last.channel("support_m").values[5], 0.035);
  EXPECT_EQ(last.source.sha256.size(), 64U);
  EXPECT_EQ(last.source.file, "desr_foot/dualcam_x35.csv.gz");
  ASSERT_EQ(dataset.input_sets.size(), 2U);
  EXPECT_EQ(dataset.input_sets[0].second.size(), 3U);
  EXPECT_EQ(dataset.input_sets[1].second.size(), 4U);
  EXPECT_TRUE(dataset.target_computed_from.empty());
  expect_finite(dataset);
}

class DesrCam : public testing::TestWithParam<std::string> {};

TEST_P(DesrCam, HoldsOutEveryFifthBlockWithAnEmbargo) {
  TORSIO_NEEDS_DATA(GetParam());
  const Dataset dataset = load_dataset({manifest_path(GetParam())}, {});
  ASSERT_EQ(dataset.records.size(), 1U);
  EXPECT_EQ(dataset.label, "interpolation within one cycle");
  EXPECT_EQ(samples_with(dataset, Role::test), 12U * 200U);
  // 50 ms are 42 samples, cut off on both sides of 11 test blocks and before the last.
  EXPECT_EQ(samples_with(dataset, Role::train), 48U * 200U - 23U * 42U);
}

INSTANTIATE_TEST_SUITE_P(All, DesrCam,
                         testing::Values("desr_cam1_interpolation", "desr_cam2_interpolation"));

TEST(DesrFoot, OneCamTrainsForTheOther) {
  TORSIO_NEEDS_DATA("desr_cam1_to_cam2");
  const Dataset dataset = load_dataset({manifest_path("desr_cam1_to_cam2")}, {});
  EXPECT_EQ(dataset.label, "different mechanism");
  EXPECT_EQ(samples_with(dataset, Role::train), 12000U);
  EXPECT_EQ(samples_with(dataset, Role::test), 12000U);
}

class Cycloidal : public testing::TestWithParam<std::string> {};

TEST_P(Cycloidal, AllTestsOfThreeVariantsLoadOnOneClock) {
  TORSIO_NEEDS_DATA(GetParam());
  const Dataset dataset = load_dataset({manifest_path(GetParam())}, {});
  ASSERT_EQ(dataset.records.size(), 3U * 8U);
  EXPECT_EQ(dataset.sample_rate_Hz(), 400.0);
  EXPECT_EQ(dataset.target_computed_from, (std::vector<std::string>{"iq_A", "tau_cmd_Nm"}));
  std::set<std::string> names;
  for (const DatasetRecord& record : dataset.records) {
    const Recording& recording = record.recording;
    names.insert(recording.name());
    const bool is_long = recording.name().find("=10") != std::string::npos;
    EXPECT_NEAR(recording.time_s(recording.size()) - recording.time_s(0), is_long ? 20.06 : 4.06,
                0.05)
        << recording.name();
    const auto& angle = recording.channel("output_angle_rad").values;
    const auto [low, high] = std::ranges::minmax(angle);
    EXPECT_LT(std::abs(low + high), 0.01) << recording.name();
    EXPECT_EQ(recording.zeros,
              (std::vector<ZeroRule>{
                  {.channel = "output_angle_rad", .first_s = 0.0, .mid_range = true}}));
    const auto& torque = recording.channel("torque_Nm").values;
    EXPECT_NEAR(*std::ranges::max_element(torque), is_long ? 26.0 : 4.6, 0.9) << recording.name();
  }
  EXPECT_EQ(names.size(), 24U);
  EXPECT_TRUE(names.contains("variant_1[test_nr=0]"));
  EXPECT_TRUE(names.contains("variant_6[test_nr=102]"));
  expect_finite(dataset);
}

INSTANTIATE_TEST_SUITE_P(AllDesigns, Cycloidal,
                         testing::Values("cycloidal_base910_reamed", "cycloidal_base_onyx_runin",
                                         "cycloidal_split_onyx_runin",
                                         "cycloidal_split_onyx_6pre"));

}  // namespace
}  // namespace torsio
