#pragma once

#include <cstddef>

#include "plant_rows.hpp"

namespace torsio::plant_kernels {

/// Blocks that stay in the nearest cache together.
inline constexpr std::size_t kTogether = 4;

/// Advances `count` blocks, best `kTogether`, by `steps` steps of `dt_s` under the commands and
/// loads in their rows.
/// Plants do not see each other: the bits of one depend on the instruction set alone.
void step(MaxwellChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(BoucWenChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(LuGreChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(BondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(UnbondedChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(ClutchChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;
void step(GearChain* blocks, std::size_t count, std::size_t steps, double dt_s) noexcept;

}  // namespace torsio::plant_kernels
