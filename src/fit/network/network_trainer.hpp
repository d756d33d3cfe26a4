#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/aligned_vector.hpp"
#include "files/training_checkpoint.hpp"
#include "fit/network/fit_network.hpp"
#include "fit/network/network_pass.hpp"
#include "fit/network/network_windows.hpp"
#include "torsio/fit/common/fit_context.hpp"

namespace torsio {

/// Gradients and updates of one network. A batch is cut into chunks of a fixed number of windows,
/// which threads share; their gradients are added in order.
class NetworkTrainer {
 public:
  NetworkTrainer(TrainingNetwork network, const NetworkTraining& settings);

  [[nodiscard]] const TrainingNetwork& network() const noexcept { return network_; }
  /// Memory that updates with windows of so many steps take, of so many windows in all.
  [[nodiscard]] double bytes(std::size_t steps, std::size_t windows) const noexcept;

  /// The mean square error of some windows, and its gradient into `gradient()`.
  double loss_and_gradient(const std::vector<float>& weights, const WindowSet& set,
                           std::span<const std::size_t> windows);
  [[nodiscard]] std::span<const float> gradient() const noexcept {
    return {gradients_.data(), network_.parameter_count()};
  }

  /// One step of the optimiser with `loss_and_gradient` of these windows. NaN, and nothing is
  /// changed, where the loss or the gradient is not finite.
  /// @returns the loss before the step.
  double update(TrainingCheckpoint& state, const WindowSet& set,
                std::span<const std::size_t> windows, double learning_rate);

  /// The mean square error of all windows.
  double loss(const std::vector<float>& weights, const WindowSet& set);

 private:
  struct Workspace {
    SequenceBatch batch;
    NetworkPass pass;
  };
  class Lease;

  [[nodiscard]] std::size_t chunks_of(std::size_t windows) const noexcept {
    return (windows + chunk_rows_ - 1) / chunk_rows_;
  }
  [[nodiscard]] std::span<const std::size_t> chunk(std::span<const std::size_t> windows,
                                                   std::size_t index) const noexcept;
  void apply(TrainingCheckpoint& state, double learning_rate, double gradient_scale) const;

  TrainingNetwork network_;
  NetworkTraining settings_;
  std::size_t chunk_rows_;
  PackedNetwork packed_;
  detail::AlignedVector<float> gradients_;  ///< [chunk x parameters], the sum ends up in the first
  std::mutex guard_;                        ///< protects `idle_`
  std::vector<std::unique_ptr<Workspace>> idle_;
};

/// What came out of a training.
struct TrainedNetwork {
  std::vector<float> weights;  ///< from the best epoch
  std::size_t epochs = 0;      ///< run in all
  std::size_t best_epoch = 0;
  double best_loss = 0.0;  ///< standardised mean square error
  std::string end;         ///< why it ended, in words; empty: all epochs were run
};

/// From the initial weights, or from `context.resume`, to the end. `validation` without windows: the
/// loss of training decides.
[[nodiscard]] TrainedNetwork train_network(NetworkTrainer& trainer, const NetworkTraining& settings,
                                           const WindowSet& training, const WindowSet& validation,
                                           std::vector<float> initial_weights,
                                           const std::string& recipe, const FitContext& context);

/// The learning rate of an update, of so many in all.
[[nodiscard]] double learning_rate_at(const NetworkTraining& settings, std::size_t update,
                                      std::size_t updates_in_all) noexcept;

}  // namespace torsio
