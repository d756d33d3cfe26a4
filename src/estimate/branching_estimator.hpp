#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// An estimator in a simulator that evaluates its forces several times per step, repeats steps and branches. All that a
/// step changes is in a record of the simulator, an array of doubles of which it makes copies; a record of zeros is the
/// state after a reset.
///
/// The record holds the state A before a tick and, once the tick was evaluated, the state B after it. `commit` replaces A
/// by B. A tick is evaluated at the earliest time t since the commit, and again if that time comes again. At t + a T,
/// between this tick and the next one, the value for inputs x is
///
///     (1 - a) f(A, x) + a f(B, x)      f(S, x) a tick with the inputs x from the state S, 0 < a <= 1
///
/// which is that of the tick for a = 0 and that of the next one for a = 1. The time since the last tick that rates and
/// relaxations assume is right on average. These evaluations leave the record as it is.
class BranchingEstimator {
 public:
  static constexpr std::size_t kMaxInputs = 16;

  /// @param period_s of the simulator's clock between two ticks
  /// @param copies evaluations that can take place at the same time; a further one waits for one of them
  /// @throws Error if the state of the estimator cannot be saved, or it has more than `kMaxInputs` inputs
  BranchingEstimator(const Estimator& estimator, double period_s, std::size_t copies);

  /// Doubles of a record.
  [[nodiscard]] std::size_t record_size() const noexcept { return record_size(state_bytes_); }
  [[nodiscard]] static std::size_t record_size(std::size_t state_bytes) noexcept;

  /// @param raw finite or not, one for each of the estimator's `raw_inputs()`
  /// @returns a finite value. From 1.5 ticks after one that was not committed it is that of `Fault::wrong_rate`.
  double value(std::span<double> record, double time_s,
               std::span<const double> raw) const noexcept TORSIO_REALTIME;
  /// To be called after each step of the simulator. Without effect until the time of the next tick; ticks that did not
  /// take place until then are a gap for the next one.
  void commit(std::span<double> record, double time_s) const noexcept TORSIO_REALTIME;
  /// What the last tick estimated.
  [[nodiscard]] static Estimate last(std::span<const double> record) noexcept TORSIO_REALTIME;
  /// The state after as many ticks at rest, for at most `longest_s`, as filters and memory need to settle.
  void settle(std::span<double> record, std::span<const double> raw,
              double longest_s) const noexcept;

 private:
  struct Copy {
    explicit Copy(Estimator of) : estimator(std::move(of)) {}
    Estimator estimator;
    std::atomic_flag is_used = {};
  };
  class Lease;

  double period_s_;
  std::size_t state_bytes_;
  std::vector<std::unique_ptr<Copy>> copies_;
};

}  // namespace torsio
