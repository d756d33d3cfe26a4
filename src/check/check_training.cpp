#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "check/checker.hpp"
#include "fit/common/held_out.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/training_rules.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

/// The clauses of an error in front of its advice.
std::string problem_of(const Error& error) {
  const std::string_view text = error.what();
  return std::string(text.substr(0, text.find('\n')));
}

}  // namespace

// What a curve over the inputs explains of other samples of the same recordings; whether it explains any.
bool Checker::check_determination(const TrainingData& data) {
  const auto target = split_channel_name(data.target);
  if (!target || target->unit->si_suffix != "Nm") return true;
  const FamilyInfo& curve = find_family("polynomial");
  const HeldOutErrors held_out = held_out_errors(data, [&](const TrainingData& rest) {
    return curve.fit(rest, Options(curve.options, {}), {});
  });
  if (!(held_out.rmse > kDetermined * held_out.constant_rmse)) return true;
  add(Verdict::fail, "training data", "",
      fmt::format("the inputs do not determine {}: a curve fitted to two thirds of each recording "
                  "has an RMSE of {:.3g} {} in the rest, a constant {:.3g}",
                  data.target, held_out.rmse, unit_label(data.target), held_out.constant_rmse),
      "Check that inputs and target are of the same joint and time, and that the torque sensor "
      "measures.");
  return false;
}

// A sensor that writes something else than its quantity can still be correlated with the motion.
void Checker::check_explanation() {
  const auto target = split_channel_name(dataset_.target);
  if (!target || target->unit->si_suffix != "Nm") return;
  std::vector<std::pair<double, double>> left_of(pairs_.size());  // squares that are left, and all
  for_each_record([&](std::size_t r) {
    const DatasetRecord& record = dataset_.records[r];
    if (!record.has_role(Role::train)) return;
    std::vector<std::vector<double>> others;
    auto share = unexplained_share(pairs_[r], others);
    if (share && *share > kMaxUnexplained && spec_.inputs.size() > 1) {
      for (std::size_t k = 1; k < spec_.inputs.size(); ++k)
        others.push_back(first_feature(record.recording, spec_of(k)));
      share = unexplained_share(pairs_[r], others);
    }
    if (!share) return;
    const double squares = variation_of(pairs_[r].target).squares;
    left_of[r] = {*share * squares, squares};
  });
  double left = 0.0;
  double squares = 0.0;
  for (const auto& [of_left, of_squares] : left_of) left += of_left, squares += of_squares;
  if (!(left > kMaxUnexplained * squares)) return;
  add(Verdict::fail, "training data", "",
      fmt::format(
          "a curve with hysteresis over {}, and the other inputs, leave {:.0f} % of {} unexplained",
          spec_.inputs.front(), 100.0 * left / squares, dataset_.target),
      "Plot both: something else than the torque of this joint is in the log, or an input is "
      "missing that it depends on.");
}

// The rules of `fit` are applied, not repeated: what it refuses is a FAIL with its own message.
void Checker::check_training() {
  if (has_failed()) return;
  pass_unless_found("training data", "fit accepts the recordings", [&] {
    try {
      LearningData data = learning_data(dataset_, spec_);
      require_samples(data.training);
      require_motion(data.training);
      if (dataset_.has_role(Role::test)) data.test = training_data(dataset_, spec_, Role::test);
      std::size_t samples = 0;
      std::size_t finite = 0;
      for (const Sequence& sequence : data.training.sequences) {
        samples += sequence.target.size();
        for (std::size_t n = 0; n < sequence.target.size(); ++n)
          if (sequence.has_features(n)) ++finite;
      }
      if (finite < samples)
        add(Verdict::warn, "training data", "",
            fmt::format("inputs are not finite in {} of {} samples", samples - finite, samples),
            "They are neither trained on nor scored. Change the expressions so that they stay "
            "finite.");
      const std::size_t usable = data.training.usable_samples();
      if (usable < kLeastGreyBoxSamples)
        add(Verdict::warn, "training data", "",
            fmt::format("only {} samples can be used for training, and grey_box needs {}", usable,
                        kLeastGreyBoxSamples),
            "Samples are not used where the target is not a new one, where an input is not finite, "
            "and until the filters of the inputs have settled. Make longer recordings.");
      for (const std::string& recording : unused_recordings(data.training))
        add(Verdict::warn, "training data", recording, "no sample of it can be used",
            "Check the freshness column of the target and the length of the recording: filters of "
            "the inputs must settle first.");
      if (check_determination(data.training)) check_explanation();
      data_ = std::move(data);
    } catch (const Error& error) {
      add(Verdict::fail, "training data", "", problem_of(error), error.report().advice);
    }
  });
}

}  // namespace torsio
