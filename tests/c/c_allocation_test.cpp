#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "support/allocation_counter.hpp"
#include "support/example_model_file.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/network.hpp"
#include "support/numbers.hpp"
#include "torsio.h"

namespace torsio::test {
namespace {

class CInterface : public testing::TestWithParam<ModelFile> {};

TEST_P(CInterface, StepAndStateNeverTouchTheHeap) {
  const std::vector<std::byte> bytes = model_bytes(GetParam());
  torsio_estimator* const joint = torsio_load_bytes(bytes.data(), bytes.size(), nullptr);
  ASSERT_NE(joint, nullptr) << torsio_last_error();
  ASSERT_EQ(torsio_set_zero(joint, "joint_angle_rad", 0.01), 0);
  std::vector<char> state(torsio_state_size(joint));
  ASSERT_FALSE(state.empty());
  constexpr int kSteps = 1'000'000;
  int usable = 0;
  EXPECT_EQ(heap_calls_during([&] {
              for (int n = 0; n < kSteps; ++n) {
                const std::array raw{n % 9973 == 0 ? kNaN : 0.4 * std::sin(0.002 * n), 0.02};
                torsio_estimate estimate = torsio_step(joint, raw.data(), n % 7919 == 0 ? 1 : 2);
                if (n % 5 == 0) (void)torsio_step_into(joint, raw.data(), raw.size(), &estimate);
                usable += estimate.fault == TORSIO_FAULT_NONE ? 1 : 0;
                if (n % 1000 == 0) {
                  (void)torsio_state_save(joint, state.data(), state.size());
                  (void)torsio_state_load(joint, state.data(), state.size());
                  (void)torsio_state_load(joint, state.data(), state.size() - 1);
                }
              }
              (void)torsio_step(nullptr, nullptr, 2);
              torsio_reset(joint);
            }),
            0U);
  EXPECT_GT(usable, kSteps / 10);
  torsio_free(joint);
}

INSTANTIATE_TEST_SUITE_P(Models, CInterface,
                         testing::Values(example_model_file(example<GreyBox>()),
                                         example_model_file(example<Lstm>())),
                         [](const auto& of) { return std::string(of.param.parameters.family()); });

}  // namespace
}  // namespace torsio::test
