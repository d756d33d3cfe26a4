#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace torsio {

/// A seeded generator that gives the same numbers on every platform and compiler (the
/// distributions of <random> do not): xoshiro256++ (Blackman and Vigna 2021), its state filled by
/// SplitMix64. Period 2^256 - 1; not for secrets.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept {
    for (std::uint64_t& word : state_) {
      seed += 0x9e3779b97f4a7c15U;
      std::uint64_t mixed = seed;
      mixed = (mixed ^ (mixed >> 30U)) * 0xbf58476d1ce4e5b9U;
      mixed = (mixed ^ (mixed >> 27U)) * 0x94d049bb133111ebU;
      word = mixed ^ (mixed >> 31U);
    }
  }

  /// 64 independent fair bits.
  std::uint64_t bits() noexcept {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17U;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1), a multiple of 2^-53.
  double uniform() noexcept { return static_cast<double>(bits() >> 11U) * 0x1p-53; }
  /// Uniform in [lowest, highest).
  double uniform(double lowest, double highest) noexcept {
    return lowest + (highest - lowest) * uniform();
  }

  /// Standard normal, by Marsaglia's polar method. `std::log` may differ in its last bit between
  /// platforms; the sequence of `bits()` does not.
  double normal() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double x = 0.0;
    double y = 0.0;
    double square = 0.0;
    do {
      x = 2.0 * uniform() - 1.0;
      y = 2.0 * uniform() - 1.0;
      square = x * x + y * y;
    } while (square >= 1.0 || square == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(square) / square);
    spare_ = y * factor;
    has_spare_ = true;
    return x * factor;
  }

  /// Uniform in 0 .. n - 1, without the modulo's bias. Requires n > 0.
  std::size_t below(std::size_t n) noexcept {
    const std::uint64_t too_low = (0 - static_cast<std::uint64_t>(n)) % n;
    std::uint64_t draw = bits();
    while (draw < too_low) draw = bits();
    return static_cast<std::size_t>(draw % n);
  }

 private:
  std::array<std::uint64_t, 4> state_{};
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace torsio
