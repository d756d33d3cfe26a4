#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;

struct BenchFlags {
  std::string models = "all";
  std::string actuator = "dfki-50";
  std::string rate = "1kHz";
  JsonOutput json;
};

void run(const BenchFlags& flags) {
  DataFlags().check_outputs({flags.json.destination});
  const double rate_Hz =
      above_zero(torsio::signed_quantity_with_unit(flags.rate, "Hz", "--loop-rate"), "--loop-rate");
  const double period_ns = 1e9 / rate_Hz;
  ProgressBar progress;
  const torsio::Dataset dataset =
      torsio::sweep_dataset(flags.actuator, kDefaultSeed, progress.listener());
  const auto choices = torsio::model_choices(dataset, flags.models, {});
  torsio::Comparison comparison =
      torsio::compare(dataset, choices, kDefaultSeed, false, progress.listener());
  auto& rows = comparison.results.rows;
  std::erase_if(rows, [](const torsio::ResultRow& row) {
    return row.recording || row.split != torsio::Role::test || row.status != "ok";
  });
  std::ranges::sort(rows, {}, [](const torsio::ResultRow& row) { return row.score.step_ns_p50; });
  torsio::TextTable table;
  table.header(
      {"model", "step ns", "p99.9", "share of a cycle %", "joints in a cycle", "parameters"});
  Json models = Json::array();
  for (const torsio::ResultRow& row : rows) {
    const double slow_ns = row.score.step_ns_p999;
    const std::string name =
        row.variant.empty() ? row.family : fmt::format("{}[{}]", row.family, row.variant);
    models.push_back({{"model", name},
                      {"step_ns", row.score.step_ns_p50},
                      {"step_p999_ns", slow_ns},
                      {"cycle_share", slow_ns / period_ns},
                      {"parameters", row.parameter_count}});
    table.row({name, fmt::format("{:.0f}", row.score.step_ns_p50), fmt::format("{:.0f}", slow_ns),
               fmt::format("{:.2g}", 100.0 * slow_ns / period_ns),
               fmt::format("{:.0f}", std::max(period_ns / slow_ns, 0.0)),
               fmt::format("{}", row.parameter_count)});
  }
  if (flags.json.wants_tables())
    print(fmt::format(
        "{}\nOne step of the estimator on this machine, in a loop of {:g} Hz; share and "
        "joints by the "
        "99.9 % quantile.\nThe models are fitted to sweeps of a simulated {}.\n",
        table.text(), rate_Hz, flags.actuator));
  flags.json.write(torsio::json_text(Json{
      {"actuator", flags.actuator}, {"loop_rate_Hz", rate_Hz}, {"models", std::move(models)}}));
}

}  // namespace

void add_bench(CLI::App& app) {
  auto flags = std::make_shared<BenchFlags>();
  CLI::App* verb = app.add_subcommand(
      "bench", "the time of a step of each family on this machine: what a loop can afford");
  verb->footer("Example: torsio bench --loop-rate 2kHz --models linear,grey_box,lstm");
  verb->add_option("--models", flags->models, "as for compare")->capture_default_str();
  verb->add_option("--actuator", flags->actuator, "the simulated bench")->capture_default_str();
  verb->add_option("--loop-rate", flags->rate, "rate of the loop")->capture_default_str();
  flags->json.add(*verb, "the times");
  verb->callback([flags] { run(*flags); });
}
