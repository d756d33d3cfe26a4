#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "bindings.hpp"
#include "evaluate/compared_target.hpp"
#include "report/cross_validation.hpp"
#include "report/drift.hpp"
#include "report/transfer.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/check/check.hpp"
#include "torsio/evaluate/attribution.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/attribution.hpp"
#include "torsio/report/check.hpp"
#include "torsio/report/results.hpp"

namespace torsio::python {
namespace {

using Names = std::vector<std::string>;

// Results leave as the JSON documents of docs/use/json.md; the package makes dataclasses of them.

std::string check(const Dataset& dataset, const Names& inputs, bool advise_too) {
  return interruptible([&](const Progress& progress) {
    const FeatureSpec spec = resolve_inputs(dataset, inputs);
    const std::vector<Finding> findings = check_dataset(dataset, spec);
    if (!advise_too || worst(findings) == Verdict::fail) return check_json(findings);
    const Advice advice = advise(dataset, spec, {}, progress);
    return check_json(findings, &advice);
  });
}

/// As `torsio fit` does: a model that diverges on its own training data is refused, and the card gets the
/// scores on the held-out samples.
Model fit(const Dataset& dataset, const std::string& family,
          const std::map<std::string, std::string>& options, const Names& inputs,
          std::uint64_t seed, bool allow_leak, const std::string& serial) {
  return interruptible([&](const Progress& progress) {
    constexpr double kTrained = 0.95;  // share of the time that the scores do not take (assumed)
    const Progress training = [&](double done, std::string_view doing) {
      return progress(kTrained * done, doing);
    };
    const Progress scoring = [&](double done, std::string_view doing) {
      return progress(kTrained + (1.0 - kTrained) * done, doing);
    };
    const FeatureSpec features = resolve_inputs(dataset, inputs);
    (void)refuse_leak(dataset, features, allow_leak);
    TrainedModel trained = train_model(dataset, {family, options, "", features}, seed, training);
    trained.file.card.device_serial = serial;
    Results results = evaluate_model(trained.file, dataset, scoring);
    mark_divergence_in_training(results.rows);
    if (results.rows.front().status == "diverged")
      throw Error({.place = results.rows.front().family,
                   .problem = "diverged " + results.rows.front().reason,
                   .advice =
                       "Run torsio.check on the recordings, or choose other inputs, options or "
                       "another family."});
    note_held_out_scores(trained.file.card, results.rows);
    return Model{std::make_shared<const ModelFile>(std::move(trained.file)),
                 std::move(trained.notes), std::move(trained.table), trained.fit_seconds};
  });
}

/// Recordings of any role for a model of this target.
/// @param target with which it is compared; empty: its own
Dataset for_model(Dataset dataset, const Model& model, std::optional<Role> role,
                  const std::string& target = {}) {
  dataset.target = compared_target(*model.file, target);
  if (role)
    for (DatasetRecord& record : dataset.records)
      record.segments = whole_record(record.recording.size(), *role);
  dataset.check();
  return dataset;
}

std::string evaluate(const Model& model, const Dataset& dataset, const std::string& target) {
  return interruptible([&](const Progress& progress) {
    return results_json(
        evaluate_model(*model.file, for_model(dataset, model, {}, target), progress));
  });
}

std::pair<std::string, std::optional<Model>> compare(const Dataset& dataset,
                                                     const std::string& models, const Names& inputs,
                                                     std::uint64_t seed, bool allow_leak) {
  return interruptible([&](const Progress& progress) {
    Comparison comparison = torsio::compare(dataset, model_choices(dataset, models, inputs), seed,
                                            allow_leak, progress);
    std::optional<Model> best;
    if (comparison.best)
      best = Model{std::make_shared<const ModelFile>(std::move(comparison.best->file)),
                   std::move(comparison.best->notes), std::move(comparison.best->table),
                   comparison.best->fit_seconds};
    return std::pair(results_json(comparison.results), std::move(best));
  });
}

std::string crossvalidate(const Dataset& dataset, const std::string& models, const Names& inputs,
                          std::size_t folds, const std::string& by, double embargo_s,
                          std::uint64_t seed, bool allow_leak) {
  return interruptible([&](const Progress& progress) {
    return cross_validation_json(cross_validate(dataset, model_choices(dataset, models, inputs),
                                                {.folds = folds, .embargo_s = embargo_s, .by = by},
                                                seed, allow_leak, progress));
  });
}

std::string attribute(const Model& model, const Dataset& dataset,
                      const AttributionOptions& options) {
  return interruptible([&](const Progress& progress) {
    const Dataset tested = for_model(dataset, model, Role::test);
    (void)make_estimator(*model.file, tested.sample_rate_Hz());
    const TrainingData data = training_data(tested, model.file->settings.features, Role::test);
    return attribution_json(
        torsio::attribute(AnyModel(model.file->parameters), data, options, progress),
        {.model = "",
         .family = model.file->card.fitted_as,
         .target = tested.target,
         .sample_rate_Hz = tested.sample_rate_Hz()});
  });
}

std::string drift(const Model& model, const Dataset& dataset, const std::optional<Model>& reference,
                  std::uint64_t seed) {
  return interruptible([&](const Progress& progress) {
    DriftOptions options{.seed = seed};
    if (reference) options.reference = reference->file.get();
    return drift_json(
        detect_drift(*model.file, for_model(dataset, model, Role::test), options, progress),
        model.file->settings.target);
  });
}

std::pair<std::string, Model> transfer(const Model& base, Dataset dataset, double use_s,
                                       const std::string& method, std::uint64_t seed) {
  return interruptible([&](const Progress& progress) {
    TransferOptions options;
    std::string known = "auto";
    for (int i = 0; i <= static_cast<int>(TransferMethod::refit); ++i) {
      const auto each = static_cast<TransferMethod>(i);
      if (name(each) == method) options.method = each;
      known += ", " + std::string(name(each));
    }
    if (!options.method && method != "auto")
      throw UsageError({.place = "method", .expected = "one of " + known, .found = method});
    Dataset used = for_model(std::move(dataset), base, {});
    if (used.has_role(Role::test))
      used = with_training_time(std::move(used), use_s);
    else
      hold_out_after(used, use_s);
    TransferEvaluation evaluation = evaluate_transfer(*base.file, used, options, seed, progress);
    std::string document = transfer_json(evaluation, {}, base.file->settings.target);
    return std::pair(
        std::move(document),
        Model{.file = std::make_shared<const ModelFile>(evaluation.transfer.best().file)});
  });
}

std::vector<std::tuple<std::string, std::string,
                       std::vector<std::tuple<std::string, std::string, std::string>>>>
known_families() {
  decltype(known_families()) all;
  for (const FamilyInfo& family : families()) {
    std::vector<std::tuple<std::string, std::string, std::string>> options;
    for (const OptionInfo& option : family.options)
      options.emplace_back(option.name, option.default_value,
                           std::string(option.help) + range_of(option));
    all.emplace_back(family.name, family.summary, std::move(options));
  }
  return all;
}

}  // namespace

void bind_learning(py::module_& module) {
  module.def("families", known_families,
             "(name, summary, options) of every family; an option is (name, default, meaning).");
  module.def("check", check, py::arg("dataset"), py::arg("inputs"), py::arg("advise"));
  module.def("fit", fit, py::arg("dataset"), py::arg("family"), py::arg("options"),
             py::arg("inputs"), py::arg("seed"), py::arg("allow_leak"), py::arg("serial"));
  module.def("evaluate", evaluate, py::arg("model"), py::arg("dataset"), py::arg("target"));
  module.def("compare", compare, py::arg("dataset"), py::arg("models"), py::arg("inputs"),
             py::arg("seed"), py::arg("allow_leak"));
  module.def("crossvalidate", crossvalidate, py::arg("dataset"), py::arg("models"),
             py::arg("inputs"), py::arg("folds"), py::arg("by"), py::arg("embargo_s"),
             py::arg("seed"), py::arg("allow_leak"));
  module.def(
      "attribute",
      [](const Model& model, const Dataset& dataset, std::size_t windows, std::size_t background,
         std::size_t window_samples, std::size_t repeats, std::uint64_t seed) {
        return attribute(model, dataset,
                         {.windows = windows,
                          .background = background,
                          .window_samples = window_samples,
                          .repeats = repeats,
                          .seed = seed});
      },
      py::arg("model"), py::arg("dataset"), py::arg("windows"), py::arg("background"),
      py::arg("window_samples"), py::arg("repeats"), py::arg("seed"));
  module.def("drift", drift, py::arg("model"), py::arg("dataset"), py::arg("reference"),
             py::arg("seed"));
  module.def("transfer", transfer, py::arg("base"), py::arg("dataset"), py::arg("use_s"),
             py::arg("method"), py::arg("seed"));
}

}  // namespace torsio::python
