#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "published.hpp"
#include "studies.hpp"
#include "study_models.hpp"
#include "study_rows.hpp"
#include "torsio/data/load.hpp"
#include "torsio/evaluate/comparison.hpp"

namespace torsio {
namespace {

struct Benchmark {
  std::string_view name;
  std::string_view train;
  std::array<std::string_view, 2> tests;  ///< the second may be empty
  std::string_view target;
  std::string_view input;
  double rate_Hz;  ///< sample rate of recordings without a clock; 0: they have one
  std::span<const PaperEntry> published;
};

constexpr Benchmark kBoucWen{.name = "boucwen",
                             .train = "train_multisine.csv.gz",
                             .tests = {"test_multisine.csv.gz", "test_sinesweep.csv.gz"},
                             .target = "y_m",
                             .input = "u_N",
                             .rate_Hz = 750.0,
                             .published = kPublishedBoucWen};

// The drive's gain of 35.15 N/V is that of the benchmark's authors.
constexpr Benchmark kEmps{.name = "emps",
                          .train = "emps_est.csv.gz",
                          .tests = {"emps_val.csv.gz", ""},
                          .target = "qm_m",
                          .input = "vir_V * 35.15",
                          .rate_Hz = 0.0,
                          .published = kPublishedEmps};

std::string recordings_folder() {
  Manifest places;
  places.file = "public-benchmarks";
  places.roots = {"${TORSIO_DATA}", "../shared/data"};
  return data_folder(places);
}

Dataset records_of(const Benchmark& benchmark, const Progress& progress) {
  const std::string at = recordings_folder() + "/" + std::string(benchmark.name) + "/";
  std::vector<std::string> tests;
  for (const std::string_view test : benchmark.tests)
    if (!test.empty()) tests.push_back(at + std::string(test));
  LoadOptions load;
  load.target = benchmark.target;
  load.progress = progress;
  if (benchmark.rate_Hz > 0.0) load.rate_Hz = benchmark.rate_Hz;
  return load_dataset({at + std::string(benchmark.train)}, tests, load);
}

/// Our rows, then those of others.
void add_rows(const Benchmark& benchmark, std::span<const BenchmarkModel> entries, Study& study,
              const Progress& progress) {
  const Dataset dataset = records_of(benchmark, progress);
  const auto condition_of = [&](const std::string& recording) {
    return fmt::format("{} {}", benchmark.name, recording);
  };
  StudyRows rows;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const BenchmarkModel& entry = entries[i];
    const std::string_view choice = study.options.is_quick ? entry.quick : entry.choice;
    if (choice.empty()) continue;
    if (choice != entry.name)
      study.notes.push_back(fmt::format("{}, {}: --models {}", benchmark.name, entry.name, choice));
    const auto choices = model_choices(dataset, choice, {std::string(benchmark.input)});
    const std::size_t repeats = entry.is_seeded ? study.options.repeats : 1;
    for (std::size_t k = 0; k < repeats; ++k) {
      const Progress part = nth_of(progress, i * repeats + k, entries.size() * repeats, entry.name);
      rows.add(compare(dataset, choices, repeat_seed(study.options, k), false, part).results,
               dataset, Role::test, condition_of,
               [&](const ResultRow& /*row*/) { return std::string(entry.name); });
    }
  }
  auto& table = std::get<ErrorTable>(study.table);
  std::ranges::move(rows.errors(), std::back_inserter(table.rows));
  for (const PaperEntry& each : benchmark.published)
    table.rows.push_back({StudyRow{.condition = std::string(each.condition),
                                   .model = std::string(each.model),
                                   .published = {{each.quantity, each.figure}}}});
}

}  // namespace

Study public_benchmarks(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "official training and test records, free run; the start from the first 50 samples, "
          "of recurrent networks the zero state and a window to warm up, neither scored; the "
          "published figures of boucwen are those of its multisine test",
      .unit = "m",
      .options = options,
      .table = ErrorTable{.shows_fit_time = true}};
  add_rows(kBoucWen, kBoucWenModels, study, nth_of(progress, 0, 2, kBoucWen.name));
  add_rows(kEmps, kEmpsModels, study, nth_of(progress, 1, 2, kEmps.name));
  return study;
}

}  // namespace torsio
