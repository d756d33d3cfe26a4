#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace torsio {

/// The state of a long training when it was stopped: the next update is identical to that of a
/// training without the stop, to the last bit. Plain data.
struct TrainingCheckpoint {
  /// Data, settings and seed as text: a training with another recipe cannot continue from here.
  std::string recipe;
  std::size_t epoch = 0;       ///< whole epochs done
  std::size_t batch = 0;       ///< batches of the next epoch done
  std::size_t updates = 0;     ///< updates of the weights, in all
  double epoch_loss = 0.0;     ///< sum over the batches of the epoch begun
  std::size_t best_epoch = 0;  ///< counted from 1; 0: no epoch has ended yet
  double best_loss = 0.0;
  std::vector<float> weights;
  std::vector<float> mean;    ///< the optimiser's, of the gradient
  std::vector<float> square;  ///< the optimiser's mean of the squared gradient
  std::vector<float> best;    ///< weights of the best epoch
  // In an ensemble, the members that were trained before this one.
  std::vector<float> finished;        ///< their weights, one after the other
  std::vector<double> finished_loss;  ///< their best losses

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("epoch", self.epoch);
    visit("batch", self.batch);
    visit("updates", self.updates);
    visit("epoch_loss", self.epoch_loss);
    visit("best_epoch", self.best_epoch);
    visit("best_loss", self.best_loss);
    visit("weights", self.weights);
    visit("mean", self.mean);
    visit("square", self.square);
    visit("best", self.best);
    visit("finished", self.finished);
    visit("finished_loss", self.finished_loss);
  }
  bool operator==(const TrainingCheckpoint&) const = default;
};

/// Writes a checkpoint completely or not at all, as safetensors with the recipe for metadata.
void save_checkpoint(const std::filesystem::path& path, const TrainingCheckpoint& checkpoint);

/// Reads one from an untrusted file.
/// @throws Error naming the tensor: not a checkpoint, a tensor missing, unknown, of the wrong type
/// or shape, or not finite.
[[nodiscard]] TrainingCheckpoint load_checkpoint(const std::filesystem::path& path);

}  // namespace torsio
