#include <fmt/format.h>

#include <string>
#include <utility>

#include "check/checker.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/training_rules.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

/// The clauses of an error in front of its advice.
std::string problem_of(const Error& error) {
  const std::string_view text = error.what();
  return std::string(text.substr(0, text.find('\n')));
}

}  // namespace

// The rules of `fit` are applied, not repeated: what it refuses is a FAIL with its own message.
void Checker::check_training() {
  if (has_failed()) return;
  pass_unless_found("training data", "fit accepts the recordings", [&] {
    try {
      LearningData data = learning_data(dataset_, spec_);
      require_samples(data.training);
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
      if (usable < kFewSamples)
        add(Verdict::warn, "training data", "",
            fmt::format("only {} samples can be used for training", usable),
            "Samples are not used where the target is not a new one, where an input is not finite, "
            "and until the filters of the inputs have settled. Make longer recordings.");
      for (const std::string& recording : unused_recordings(data.training))
        add(Verdict::warn, "training data", recording, "no sample of it can be used",
            "Check the freshness column of the target and the length of the recording: filters of "
            "the inputs must settle first.");
      data_ = std::move(data);
    } catch (const Error& error) {
      add(Verdict::fail, "training data", "", problem_of(error), error.report().advice);
    }
  });
}

}  // namespace torsio
