#include <gtest/gtest.h>

#include "mujoco/simulated_spring.hpp"
#include "support/allocation_counter.hpp"

namespace torsio::test {
namespace {

template <class Family>
void expect_no_heap_calls() {
  for (const char* integrator : {"Euler", "RK4"}) {
    const SimulatedSpring joint(simulated_estimator<Family>(), {.integrator = integrator});
    (void)joint.step();
    EXPECT_EQ(heap_calls_during([&] {
                joint.springs.settle(*joint.data());
                for (int tick = 0; tick < 500; ++tick)
                  (void)joint.step(driving_torque(joint.data()->time));
                joint.data()->qpos[0] = 5.0;
                (void)joint.step();
                mj_step(joint.model(), joint.data());
                mj_step(joint.model(), joint.data());
                (void)joint.springs.estimate(*joint.data(), 1);
              }),
              0U)
        << integrator;
  }
}

TEST(MujocoSprings, StepsNeverTouchTheHeap) {
  expect_no_heap_calls<GreyBox>();
  expect_no_heap_calls<Lstm>();
  expect_no_heap_calls<Dgmm>();
}

}  // namespace
}  // namespace torsio::test
