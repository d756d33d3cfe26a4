// What properties draw.

#pragma once

#include <rapidcheck.h>

#include <cstdint>

#include "torsio/core/random.hpp"

namespace torsio::test {

inline double any_number(double lowest, double highest) {
  return lowest + (highest - lowest) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

inline Random any_random() {
  return Random(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1 << 30)));
}

}  // namespace torsio::test
