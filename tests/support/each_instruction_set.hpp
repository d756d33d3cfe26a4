#pragma once

#include <hwy/targets.h>

#include <cstdint>

namespace torsio::test {

/// As many as the library is compiled for on any machine of this kind: on ARM64, NEON is the only one.
inline constexpr int kFewestInstructionSets = HWY_ARCH_X86 ? 2 : 1;

/// Calls `act(name)` once for each instruction set that this machine has and the library was
/// compiled for, with run-time dispatch held to it.
template <class Act>
void on_each_instruction_set(const Act& act) {
  const std::int64_t available = hwy::SupportedTargets() & HWY_TARGETS;
  for (std::int64_t rest = available; rest != 0; rest &= rest - 1) {
    const std::int64_t target = rest & -rest;
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    act(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace torsio::test
