#include "fit/network/network_families.hpp"

#include <array>
#include <charconv>
#include <string>
#include <utility>
#include <vector>

#include "fit/common/fitted_model.hpp"
#include "fit/network/fit_network.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr OptionInfo learning_rate(std::string_view default_value) {
  return {"learning_rate", Kind::number, default_value, 1e-12, 1e3, "of Adam"};
}
constexpr OptionInfo kOptimiser{"optimiser", Kind::text, "adam", 0, 0, "adam or adamw"};
constexpr OptionInfo kWeightDecay{
    "weight_decay",
    Kind::number,
    "0",
    0,
    1e3,
    "of weights, not of biases; adam: an L2 penalty, adamw: apart from the gradient"};
constexpr OptionInfo kSchedule{
    "learning_rate_schedule",
    Kind::text,
    "constant",
    0,
    0,
    "constant, cosine (to 0 over all epochs) or step (a tenth after half of them, a hundredth "
    "after three quarters)"};
constexpr OptionInfo kPatience{
    "patience", Kind::integer, "5",
    0,          1e6,           "epochs without a better validation loss before it stops; 0: all"};

constexpr OptionInfo kMembers{
    "members",
    Kind::integer,
    "1",
    1,
    MlpEnsemble::kMostMembers,
    "networks of an ensemble, whose mean is told and whose disagreement widens the error bar"};

constexpr std::array kMlpOptions{
    OptionInfo{"layers", Kind::text, "50-20-10", 0, 0, "units of the hidden layers"},
    OptionInfo{"activation", Kind::text, "relu", 0, 0,
               "linear, relu, tanh, softsign or elu, of the hidden layers"},
    OptionInfo{"epochs", Kind::integer, "30", 1, 1e6, "at most"},
    OptionInfo{"batch", Kind::integer, "256", 1, 1e6, "samples an update"},
    learning_rate("0.001"),
    kSchedule,
    kOptimiser,
    kWeightDecay,
    OptionInfo{"clip", Kind::number, "0", 0, 1e12, "greatest norm of the gradient; 0: any"},
    kPatience,
    kMembers};

constexpr std::array kRecurrentOptions{
    OptionInfo{"layers", Kind::text, "32", 0, 0, "units of the layers with memory: 32, 64-32"},
    OptionInfo{"head", Kind::text, "", 0, 0, "units of dense layers between these and the output"},
    OptionInfo{"head_activation", Kind::text, "relu", 0, 0,
               "linear, relu, tanh, softsign or elu, of the head"},
    OptionInfo{"window", Kind::integer, "200", 1, 1e9, "samples that training looks back over"},
    OptionInfo{"stride", Kind::integer, "20", 1, 1e9,
               "samples from the start of a window to that of the next"},
    OptionInfo{"burn_in", Kind::integer, "20", 0, 1e9,
               "first samples of a window, whose output is not judged"},
    OptionInfo{"mode", Kind::text, "sequence", 0, 0,
               "sequence: every output behind the burn-in is judged; last: only the window's last"},
    OptionInfo{"epochs", Kind::integer, "30", 1, 1e6, "at most"},
    OptionInfo{"batch", Kind::integer, "64", 1, 1e6, "windows an update"},
    learning_rate("0.003"),
    kSchedule,
    kOptimiser,
    kWeightDecay,
    OptionInfo{"clip", Kind::number, "1", 0, 1e12, "greatest norm of the gradient; 0: any"},
    kPatience,
    kMembers};

[[noreturn]] void refuse(std::string_view option, std::string expected, const std::string& found) {
  throw UsageError({.place = "option " + std::string(option),
                    .expected = std::move(expected),
                    .found = '"' + found + '"'});
}

/// "50-20-10", or with commas.
std::vector<std::size_t> sizes(const Options& options, std::string_view option) {
  const std::string& text = options.text(option);
  std::vector<std::size_t> result;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    std::size_t size = 0;
    const auto [next, failure] = std::from_chars(at, end, size);
    const bool goes_on = next != end && (*next == '-' || *next == ',') && next + 1 != end;
    if (failure != std::errc{} || (next != end && !goes_on))
      refuse(option, "numbers of units with - between them: 50-20-10", text);
    result.push_back(size);
    at = goes_on ? next + 1 : next;
  }
  return result;
}

/// The value of the first of `names` that the option is set to.
template <class Value, std::size_t kCount>
Value one_of(const Options& options, std::string_view option,
             const std::array<std::pair<std::string_view, Value>, kCount>& names) {
  std::string known;
  for (const auto& [name, value] : names) {
    if (options.text(option) == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  refuse(option, "one of " + known, options.text(option));
}

constexpr std::array<std::pair<std::string_view, Optimiser>, 2> kOptimisers{
    {{"adam", Optimiser::adam}, {"adamw", Optimiser::adamw}}};
constexpr std::array<std::pair<std::string_view, RateSchedule>, 3> kSchedules{
    {{"constant", RateSchedule::constant},
     {"cosine", RateSchedule::cosine},
     {"step", RateSchedule::step}}};
constexpr std::array<std::pair<std::string_view, bool>, 2> kModes{
    {{"sequence", false}, {"last", true}}};

NetworkTraining training_of(const Options& options) {
  return {.epochs = options.integer("epochs"),
          .batch = options.integer("batch"),
          .learning_rate = options.number("learning_rate"),
          .optimiser = one_of(options, "optimiser", kOptimisers),
          .weight_decay = options.number("weight_decay"),
          .clip = options.number("clip"),
          .schedule = one_of(options, "learning_rate_schedule", kSchedules),
          .patience = options.integer("patience")};
}

RecurrentOptions recurrent_options(const Options& options) {
  return {.layers = sizes(options, "layers"),
          .head = sizes(options, "head"),
          .head_activation = activation_of(options.text("head_activation")),
          .windows = {.length = options.integer("window"),
                      .stride = options.integer("stride"),
                      .burn_in = options.integer("burn_in"),
                      .last_only = one_of(options, "mode", kModes)},
          .training = training_of(options)};
}

FittedModel mlp(const TrainingData& data, const Options& options, const FitContext& context) {
  const MlpOptions own{.layers = sizes(options, "layers"),
                       .activation = activation_of(options.text("activation")),
                       .training = training_of(options)};
  const std::size_t members = options.integer("members");
  if (members == 1) return fitted_model(fit_mlp(data, own, context));
  return fitted_model(fit_mlp_ensemble(data, own, members, context));
}

FittedModel lstm(const TrainingData& data, const Options& options, const FitContext& context) {
  const std::size_t members = options.integer("members");
  if (members == 1) return fitted_model(fit_lstm(data, recurrent_options(options), context));
  return fitted_model(fit_lstm_ensemble(data, recurrent_options(options), members, context));
}

FittedModel gru(const TrainingData& data, const Options& options, const FitContext& context) {
  const std::size_t members = options.integer("members");
  if (members == 1) return fitted_model(fit_gru(data, recurrent_options(options), context));
  return fitted_model(fit_gru_ensemble(data, recurrent_options(options), members, context));
}

constexpr std::array kFamilies{
    FamilyInfo{.name = Mlp::kFamily,
               .summary = "neural network without memory",
               .options = kMlpOptions,
               .fit = mlp,
               .can_resume = true},
    FamilyInfo{.name = Gru::kFamily,
               .summary = "neural network with memory: gated recurrent units",
               .options = kRecurrentOptions,
               .fit = gru,
               .can_resume = true,
               .only_if_named = true},
    FamilyInfo{.name = Lstm::kFamily,
               .summary = "neural network with memory: long short-term memory",
               .options = kRecurrentOptions,
               .fit = lstm,
               .can_resume = true,
               .only_if_named = true}};

}  // namespace

std::span<const FamilyInfo> network_families() noexcept { return kFamilies; }

}  // namespace torsio
