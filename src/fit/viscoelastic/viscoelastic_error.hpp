#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/viscoelastic/spring_dashpot_network.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// By how much a network misses the target over training records.
class ViscoelasticError {
 public:
  /// @param max_scored usable samples; of more every m-th is scored
  /// @param is_at_rest each record starts relaxed; else in the state with the least error
  ViscoelasticError(const TrainingData& data, std::size_t max_scored, bool is_at_rest);

  [[nodiscard]] std::size_t residuals() const noexcept { return residuals_; }
  [[nodiscard]] double longest_s() const noexcept { return longest_s_; }
  [[nodiscard]] double period_s() const noexcept { return period_s_; }
  /// Standard deviations of first input and target over the scored samples.
  [[nodiscard]] double input_deviation() const noexcept { return input_deviation_; }
  [[nodiscard]] double target_deviation() const noexcept { return target_deviation_; }

  void evaluate(const RelaxationSpectrum& spectrum, double offset,
                std::span<double> residuals) const;

 private:
  /// The samples of a record at which the model is stepped.
  struct Run {
    std::vector<double> input = {};
    std::vector<double> target = {};
    std::vector<std::uint8_t> is_scored = {};
    std::size_t scored = 0;
  };
  template <std::size_t Count>
  void evaluate_with(const RelaxationSpectrum& spectrum, double offset,
                     std::span<double> residuals) const;
  void measure_deviations();

  std::vector<Run> runs_;
  bool is_at_rest_;
  double period_s_;
  double longest_s_ = 0.0;
  std::size_t residuals_ = 0;
  double input_deviation_ = 0.0;
  double target_deviation_ = 0.0;
};

}  // namespace torsio
