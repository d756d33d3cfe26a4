#include <array>
#include <span>
#include <string>
#include <string_view>

#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/manifest.hpp"
#include "torsio/train/comparison.hpp"

namespace torsio {
namespace {

struct Published {
  std::string_view method;
  double rmse_m;
};

struct Benchmark {
  std::string_view name;
  std::string_view train;
  std::array<std::string_view, 2> tests;  ///< the second may be empty
  std::string_view target;
  std::string_view input;
  double rate_Hz;  ///< of recordings without a clock; 0: theirs
  std::string_view models;
};

constexpr Benchmark kBoucWen{
    .name = "boucwen",
    .train = "train_multisine.csv.gz",
    .tests = {"test_multisine.csv.gz", "test_sinesweep.csv.gz"},
    .target = "y_m",
    .input = "u_N",
    .rate_Hz = 750.0,
    .models = "linear,arx,dynamic_bouc_wen,dynamic_bouc_wen:input_order=5"};

// The drive's gain of 35.15 N/V is that of the benchmark's authors.
constexpr Benchmark kEmps{.name = "emps",
                          .train = "emps_est.csv.gz",
                          .tests = {"emps_val.csv.gz", ""},
                          .target = "qm_m",
                          .input = "vir_V * 35.15",
                          .rate_Hz = 0.0,
                          .models = "linear,arx,friction_drive,friction_drive:terms=auto"};

// Free run, in metres. Bouc-Wen, official multisine test: Iacob, Beintema, Schoukens and Toth, Table 1, and Forgione and Piga 2021
// (dynoNet, and what they quote); no figure of the sine sweep test was found with its unit. EMPS:
// Forgione and Piga 2021, and Champneys et al. 2024.
constexpr std::array kPublishedBoucWen{Published{"gr-SS-NN", 7.53e-6},
                                       Published{"SS-NN Suykens improved", 8.91e-6},
                                       Published{"polynomial state space", 1.34e-5},
                                       Published{"decoupled PNLSS", 1.87e-5},
                                       Published{"dynoNet", 4.52e-5},
                                       Published{"Koopman, linear", 1.60e-4},
                                       Published{"NFIR local models", 1.63e-4}};
constexpr std::array kPublishedEmps{Published{"dynoNet", 2.64e-3}, Published{"LSTM", 7.41e-2},
                                    Published{"RNN", 8.92e-2}, Published{"GRU", 2.20e-1},
                                    Published{"MLP of past inputs", 1.21e-1}};

std::string recordings_folder() {
  Manifest places;
  places.file = "public-benchmarks";
  places.roots = {"${TORSIO_DATA}", "../shared/data"};
  return data_folder(places);
}

std::string condition_of(const Benchmark& benchmark, const std::string& recording) {
  return std::string(benchmark.name) + " " + recording;
}

void run(const Benchmark& benchmark, const std::string& folder, Study& study,
         std::span<const Published> published, const Progress& progress) {
  const std::string at = folder + "/" + std::string(benchmark.name) + "/";
  std::vector<std::string> tests;
  for (const std::string_view test : benchmark.tests)
    if (!test.empty()) tests.push_back(at + std::string(test));
  LoadOptions load;
  load.target = benchmark.target;
  load.progress = progress;
  if (benchmark.rate_Hz > 0.0) load.rate_Hz = benchmark.rate_Hz;
  const Dataset dataset = load_dataset({at + std::string(benchmark.train)}, tests, load);
  const std::string_view models = study.options.is_quick ? "linear,arx" : benchmark.models;
  const auto choices = model_choices(dataset, models, {std::string(benchmark.input)});
  StudyRows rows;
  rows.add(compare(dataset, choices, study.options.seed, false, progress).results, dataset,
           Role::test,
           [&](const std::string& recording) { return condition_of(benchmark, recording); });
  const std::vector<StudyRow> ours = rows.rows();
  study.rows.insert(study.rows.end(), ours.begin(), ours.end());
  for (const Published& each : published)
    study.rows.push_back({.condition = std::string(benchmark.name) + ", published",
                          .model = std::string(each.method),
                          .paper_rmse = each.rmse_m});
}

}  // namespace

Study public_benchmarks(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "official training and test records, free run from the first 50 samples; "
                  "the published figures of boucwen are those of its multisine test",
              .unit = "m",
              .options = options};
  const std::string folder = recordings_folder();
  run(kBoucWen, folder, study, kPublishedBoucWen,
      nth_of(progress, 0, 2, std::string(kBoucWen.name)));
  run(kEmps, folder, study, kPublishedEmps, nth_of(progress, 1, 2, std::string(kEmps.name)));
  return study;
}

}  // namespace torsio
