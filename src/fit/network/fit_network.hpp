#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "fit/common/fitted.hpp"
#include "model/network/ensemble.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

enum class Optimiser : std::uint8_t { adam, adamw };
/// The learning rate over the epochs: constant; half a cosine from its full value to 0 over all
/// epochs; a tenth after half of the epochs and a hundredth after three quarters.
enum class RateSchedule : std::uint8_t { constant, cosine, step };

inline constexpr std::array<std::string_view, 2> kOptimisers{"adam", "adamw"};
inline constexpr std::array<std::string_view, 3> kRateSchedules{"constant", "cosine", "step"};
/// Names of the enumeration `Activation`, in its order.
[[nodiscard]] std::span<const std::string_view> activation_names() noexcept;
inline constexpr std::array<std::string_view, 2> kWindowModes{"sequence", "last"};

/// How the weights of a network are found. Adam after Kingma and Ba 2015, AdamW after Loshchilov and
/// Hutter 2019, both with beta 0.9 and 0.999 and epsilon 1e-8.
struct NetworkTraining {
  std::size_t epochs = 30;  ///< at most
  std::size_t batch = 64;   ///< windows an update
  double learning_rate = 1e-3;
  Optimiser optimiser = Optimiser::adam;
  double weight_decay = 0.0;  ///< weights, never biases; adam: an L2 penalty, adamw: decoupled
  double clip = 1.0;          ///< greatest norm of the gradient; 0: any
  RateSchedule schedule = RateSchedule::constant;
  std::size_t patience = 5;  ///< epochs without a better validation loss; 0: all epochs
  std::size_t threads = 0;   ///< 0: as many as the machine has

  /// @param batch_help what a batch is made of
  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit, std::string_view batch_help) {
    visit(self.epochs, {.name = "epochs", .minimum = 1, .maximum = 1e6, .help = "at most"});
    visit(self.batch, {.name = "batch", .minimum = 1, .maximum = 1e6, .help = batch_help});
    visit(self.learning_rate,
          {.name = "learning_rate", .minimum = 1e-12, .maximum = 1e3, .help = "of Adam"});
    visit(self.schedule,
          {.name = "learning_rate_schedule",
           .help = "cosine: to 0 over all epochs; step: a tenth after half of them, a hundredth "
                   "after three quarters",
           .choices = kRateSchedules});
    visit(self.optimiser, {.name = "optimiser", .help = "of the weights", .choices = kOptimisers});
    visit(self.weight_decay,
          {.name = "weight_decay",
           .maximum = 1e3,
           .help = "of weights, not of biases; adam: an L2 penalty, adamw: apart from the "
                   "gradient"});
    visit(self.clip,
          {.name = "clip", .maximum = 1e12, .help = "greatest norm of the gradient; 0: any"});
    visit(self.patience,
          {.name = "patience",
           .maximum = 1e6,
           .help = "epochs without a better validation loss before it stops; 0: all"});
  }
};

struct MlpOptions {
  std::vector<std::size_t> layers = {50, 20, 10};
  Activation activation = Activation::relu;
  NetworkTraining training = {.batch = 256, .clip = 0.0};

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.layers, {.name = "layers", .help = "units of the hidden layers"});
    visit(self.activation,
          {.name = "activation", .help = "of the hidden layers", .choices = activation_names()});
    NetworkTraining::visit_options(self.training, visit, "samples an update");
  }
};

/// Stretches of a record that a network with memory is trained on, each from the zero state.
struct TrainingWindows {
  std::size_t length = 200;  ///< samples
  std::size_t stride = 20;   ///< from the start of one to that of the next
  std::size_t burn_in = 20;  ///< first samples, whose output is not in the loss
  bool last_only = false;    ///< sequence to one: only the last output is in the loss

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.length, {.name = "window",
                        .minimum = 1,
                        .maximum = 1e9,
                        .help = "samples that training looks back over"});
    visit(self.stride, {.name = "stride",
                        .minimum = 1,
                        .maximum = 1e9,
                        .help = "samples from the start of a window to that of the next"});
    visit(self.burn_in, {.name = "burn_in",
                         .maximum = 1e9,
                         .help = "first samples of a window, whose output is not scored"});
    visit(self.last_only,
          {.name = "mode",
           .help = "sequence: every output after the burn-in is scored; last: only the window's "
                   "last",
           .choices = kWindowModes});
  }
};

struct RecurrentOptions {
  std::vector<std::size_t> layers = {32};
  std::vector<std::size_t> head = {};  ///< dense layers before the output
  Activation head_activation = Activation::relu;
  TrainingWindows windows = {};
  NetworkTraining training = {.learning_rate = 3e-3};

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.layers, {.name = "layers", .help = "units of the layers with memory: 32, 64-32"});
    visit(self.head,
          {.name = "head", .help = "units of dense layers between these and the output"});
    visit(self.head_activation,
          {.name = "head_activation", .help = "of the head", .choices = activation_names()});
    TrainingWindows::visit_options(self.windows, visit);
    NetworkTraining::visit_options(self.training, visit, "windows an update");
  }
};

/// Trains a network on standardised inputs and target by mean square error and backpropagation
/// (through time, from the end of each window to its start). Every training sample is used once per
/// epoch, windows in a new order each epoch; the weights kept are those of the epoch with the least
/// loss on the validation records, and training ends when there was no better one for `patience`
/// epochs. Without validation records a fifth of the training records, whole ones chosen by the
/// seed, is held out for this; of a single record its last fifth, separated by one window.
///
/// Initial weights: Glorot uniform; He normal before relu and elu; recurrent ones orthogonal;
/// forget bias 1. Windows lie within one record and contain only finite inputs.
///
/// A training that ends early with an RMSE on the training windows above 1.1 times that of a linear model is
/// run again from other initial weights, at most three times in all; the network of the least such RMSE
/// remains, and a note reports it if it is still above.
///
/// Source: papers 001 and 004, specification 3.2 and 3.4. Deterministic for a seed, for any
/// number of threads. A loss that explodes (a million times that of a constant, or not finite)
/// ends the training; the best weights so far are kept and a note reports it.
/// @throws Error if no stretch of the records is as long as a window, the target is constant or not
/// finite in a training sample, the network is larger than a model file or the memory, or
/// the loss explodes in the first epoch; UsageError if an option is out of range or
/// `context.resume` has another recipe; Cancelled, after `context.keep`.
[[nodiscard]] Fitted<Mlp> fit_mlp(const TrainingData& data, const MlpOptions& options,
                                  const FitContext& context = {});
[[nodiscard]] Fitted<Lstm> fit_lstm(const TrainingData& data, const RecurrentOptions& options,
                                    const FitContext& context = {});
[[nodiscard]] Fitted<Gru> fit_gru(const TrainingData& data, const RecurrentOptions& options,
                                  const FitContext& context = {});

/// So many networks, each from initial weights, a split and an order of its own; the first is the
/// one that the fit above gives. `residual_std` is the mean of the members' losses on what they did
/// not learn from.
/// @throws as above; UsageError unless there are 2 to `Ensemble::kMaxMembers`.
[[nodiscard]] Fitted<MlpEnsemble> fit_mlp_ensemble(const TrainingData& data,
                                                   const MlpOptions& options, std::size_t members,
                                                   const FitContext& context = {});
[[nodiscard]] Fitted<LstmEnsemble> fit_lstm_ensemble(const TrainingData& data,
                                                     const RecurrentOptions& options,
                                                     std::size_t members,
                                                     const FitContext& context = {});
[[nodiscard]] Fitted<GruEnsemble> fit_gru_ensemble(const TrainingData& data,
                                                   const RecurrentOptions& options,
                                                   std::size_t members,
                                                   const FitContext& context = {});

}  // namespace torsio
