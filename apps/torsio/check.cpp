#include "torsio/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data_flags.hpp"
#include "output.hpp"
#include "progress_bar.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/clock.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/json_text.hpp"
#include "verbs.hpp"

namespace {

struct CheckFlags {
  DataFlags data;
  std::vector<std::string> test;
  JsonOutput json;
};

torsio::Verdict worst(const std::vector<torsio::Finding>& findings) {
  torsio::Verdict verdict = torsio::Verdict::pass;
  for (const torsio::Finding& finding : findings) verdict = std::max(verdict, finding.verdict);
  return verdict;
}

std::string text_of(const std::vector<torsio::Finding>& findings) {
  std::string text;
  for (const torsio::Finding& finding : findings) {
    text += fmt::format("{}  {}: {}{}\n", torsio::name(finding.verdict), finding.check,
                        finding.recording.empty() ? "" : finding.recording + ": ", finding.message);
    if (!finding.advice.empty()) text += fmt::format("      -> {}\n", finding.advice);
  }
  return text;
}

std::string json_of(const std::vector<torsio::Finding>& findings) {
  nlohmann::ordered_json document{{"verdict", torsio::name(worst(findings))},
                                  {"findings", nlohmann::ordered_json::array()}};
  for (const torsio::Finding& finding : findings)
    document["findings"].push_back(
        {{"verdict", torsio::name(finding.verdict)},
         {"check", finding.check},
         {"recording", finding.recording.empty() ? nlohmann::ordered_json(nullptr)
                                                 : nlohmann::ordered_json(finding.recording)},
         {"message", finding.message},
         {"advice", finding.advice}});
  return torsio::json_text(document);
}

/// A recording whose clock is not uniform cannot be read: that is a finding, too.
std::vector<torsio::Finding> findings_of(const CheckFlags& flags) {
  try {
    ProgressBar progress;
    const torsio::Dataset dataset = flags.data.load({}, flags.test, progress.listener());
    const torsio::FeatureSpec spec = torsio::resolve_inputs(dataset, flags.data.wanted_inputs());
    std::vector<torsio::Finding> findings{{torsio::Verdict::pass, "clock", "", "uniform", ""}};
    std::ranges::move(torsio::check_dataset(dataset, spec), std::back_inserter(findings));
    return findings;
  } catch (const torsio::ClockError& error) {
    const std::string_view message = error.what();
    return {{torsio::Verdict::fail, "clock", "", std::string(message.substr(0, message.find('\n'))),
             error.report().advice}};
  }
}

void run(CheckFlags& flags) {
  flags.data.check_outputs({flags.json.destination}, flags.test);
  const std::vector<torsio::Finding> findings = findings_of(flags);
  const torsio::Verdict verdict = worst(findings);
  if (flags.json.wants_tables())
    print(text_of(findings) + fmt::format("{}: {}\n", torsio::name(verdict),
                                          verdict == torsio::Verdict::fail
                                              ? "fix this before training"
                                          : verdict == torsio::Verdict::warn
                                              ? "a model can be trained; read the warnings"
                                              : "a model can be trained on this"));
  flags.json.write(json_of(findings));
  if (verdict == torsio::Verdict::fail)
    throw torsio::Error({.problem = "the recordings did not pass"});
}

}  // namespace

void add_check(CLI::App& app) {
  auto flags = std::make_shared<CheckFlags>();
  CLI::App* verb =
      app.add_subcommand("check", "check whether a model can be trained on recordings");
  verb->footer("Example: torsio check sweep1.csv sweep2.csv --test other_lever.csv");
  flags->data.add_recordings(*verb, "recordings, or a manifest");
  flags->data.add_mapping(*verb);
  flags->data.add_target_and_inputs(*verb);
  verb->add_option("--test", flags->test,
                   "held-out recordings: are they inside the training range?");
  verb->add_option("--json", flags->json.destination,
                   "write the findings as JSON to a file, or - for standard output");
  verb->callback([flags] { run(*flags); });
}
