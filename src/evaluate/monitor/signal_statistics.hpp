#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "evaluate/monitor/exceedance.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// The limits of the signals of a monitor, from recordings without a fault.
class SignalStatistics {
 public:
  SignalStatistics(const std::vector<MonitoredSignal>& signals, double rate_Hz);

  void add(const Recording& recording);

  /// The signals with the limits that were not given. In blocks of the recordings, the largest values
  /// have a tail that exceeds such a limit in a share `share` of the blocks; a limit has a margin at
  /// least.
  /// @throws Error for a signal that is constant, or that is to move with one that is.
  [[nodiscard]] std::vector<MonitoredSignal> limits(double share) const;

  /// Limits of a signal that follow the recordings: two of its range, its rate, and the hidden travel.
  static constexpr std::size_t kLimits = 4;

 private:
  struct State {
    explicit State(std::size_t block)
        : highest(block), lowest(block), steps(block), hidden(block) {}

    BlockMaxima highest;
    BlockMaxima lowest;  ///< maxima of the negative values
    BlockMaxima steps;   ///< between successive samples
    BlockMaxima hidden;  ///< travel of the companion while the signal keeps its value
    double lowest_value = std::numeric_limits<double>::infinity();
    double highest_value = -std::numeric_limits<double>::infinity();
    double largest_step = 0.0;
    double hidden_travel = 0.0;
    double companion_step = 0.0;
    double last = 0.0;
    double companion = 0.0;
    double last_companion = 0.0;
    bool is_started = false;
  };

  void add(State& state, std::span<const double> values, std::size_t i) const;

  std::vector<MonitoredSignal> signals_;
  std::vector<State> states_;
  std::vector<std::size_t> companions_;  ///< beyond the last signal: none
  FeatureSpec spec_;
  double rate_Hz_;
  std::size_t longest_gap_ = 0;
};

}  // namespace torsio
