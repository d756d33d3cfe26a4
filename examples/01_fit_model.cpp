// `torsio check`, `fit` and `evaluate` from code: loads recordings, checks them, fits, scores the model
// on a recording that was not used for the fit, and saves it.
//
//     example_01_fit_model test.csv model.safetensors train_1.csv [train_2.csv ...]
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "torsio/learn.hpp"

namespace {

/// Prints every finding that is not a pass. @return whether none is a failure.
bool print_findings(const std::vector<torsio::Finding>& findings) {
  bool is_usable = true;
  for (const torsio::Finding& finding : findings) {
    if (finding.verdict == torsio::Verdict::pass) continue;
    std::printf("%s %s %s: %s\n", std::string(name(finding.verdict)).c_str(), finding.check.c_str(),
                finding.recording.c_str(), finding.message.c_str());
    is_usable = is_usable && finding.verdict != torsio::Verdict::fail;
  }
  return is_usable;
}

int run(const std::string& test_file, const std::string& model_file,
        const std::vector<std::string>& training_files) {
  const torsio::Dataset dataset = torsio::load_dataset(training_files, {test_file});

  // Without a list of inputs: the deflection, its filtered rate and the joint's speed, where recorded.
  const torsio::FeatureSpec features = torsio::resolve_inputs(dataset, {});
  if (!print_findings(torsio::check_dataset(dataset, features))) return 1;

  const torsio::ModelChoice choice{
      .family = "grey_box", .options = {{"passive", "true"}}, .features = features};
  const torsio::TrainedModel trained = torsio::train_model(dataset, choice, 1);
  for (const std::string& note : trained.notes) std::printf("note: %s\n", note.c_str());

  const torsio::Estimator estimator = torsio::make_estimator(trained.file);
  const torsio::Score score = torsio::evaluate(estimator, dataset, torsio::Role::test).together;
  std::printf("RMSE %.3g Nm on %zu test samples, %.0f ns per step\n", score.metrics.rmse,
              score.metrics.samples, score.step_ns_p50);

  torsio::save_model(model_file, trained.file);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  if (arguments.size() < 4) {
    std::fprintf(stderr, "usage: %s test.csv model.safetensors train.csv ...\n", arguments[0]);
    return 2;
  }
  try {
    return run(arguments[1], arguments[2], {arguments.begin() + 3, arguments.end()});
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
