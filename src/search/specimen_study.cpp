#include "search/specimen_study.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>

#include "evaluate/fit_and_score.hpp"
#include "evaluate/model_entry.hpp"
#include "search/scored_model_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/signal/feature_pipeline.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using SpecimenJson = nlohmann::ordered_json;

std::uint64_t serial_of(std::string_view text, std::string_view whole) {
  std::uint64_t serial = 0;
  const char* const end = text.data() + text.size();
  const auto [at, code] = std::from_chars(text.data(), end, serial);
  if (text.empty() || code != std::errc{} || at != end)
    throw UsageError({.place = "--specimens",
                      .expected = "an actuator with two serial numbers: dfki-50#0001..#1000",
                      .found = '"' + std::string(whole) + '"'});
  return serial;
}

}  // namespace

SpecimenRequest specimen_range(std::string_view text) {
  const std::size_t mark = text.find('#');
  const std::size_t dots = text.find("..#");
  const auto part = [&](std::size_t begin, std::size_t end) {
    return begin < end && end <= text.size() ? text.substr(begin, end - begin) : std::string_view();
  };
  SpecimenRequest request;
  request.first =
      serial_of(mark == std::string_view::npos ? std::string_view() : part(mark + 1, dots), text);
  request.last = serial_of(part(dots + 3, text.size()), text);
  request.actuator = text.substr(0, mark);
  constexpr std::uint64_t kMost = 1'000'000;
  if (request.last < request.first || request.last - request.first >= kMost)
    throw UsageError({.place = "--specimens",
                      .expected = fmt::format("1 to {} serial numbers in rising order", kMost),
                      .found = '"' + std::string(text) + '"'});
  return request;
}

SpecimenStudy::SpecimenStudy(SpecimenRequest request) : request_(std::move(request)) {
  const std::string& model = request_.model;
  if (model == "all" || model == kSearch || split_inputs(model).size() != 1)
    throw UsageError({.place = "--models",
                      .expected = "one model, with its settings or without: each specimen gets one",
                      .found = '"' + model + '"',
                      .advice = "Run one study for each model."});
  check_model_entry(model);
}

std::vector<Trial> SpecimenStudy::first_trials() const {
  std::vector<Trial> trials;
  for (std::uint64_t serial = request_.first; serial <= request_.last; ++serial) {
    const std::string device = fmt::format("{}#{:04}", request_.actuator, serial);
    trials.push_back({.key = device, .group = "specimens", .device = device, .priority = 1.0});
  }
  return trials;
}

TrialResult SpecimenStudy::run(const Claim& claim, const Progress& progress) {
  Dataset dataset;
  constexpr auto kRoles = std::to_array<Role>({Role::train, Role::test});
  for (std::size_t i = 0; i < kRoles.size(); ++i) {
    Recording recording = simulate({.actuator = claim.device,
                                    .experiment = request_.experiment,
                                    .seed = request_.seed + i,
                                    .duration_s = request_.duration_s},
                                   progress);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, kRoles.at(i))});
  }
  const std::vector<ModelChoice> choices = model_choices(dataset, request_.model, {});
  InputSets inputs(dataset, false);
  const ScoredModel scored =
      fit_and_score(dataset, inputs, choices.front(), request_.seed, kRoles, progress);
  return trial_result(scored.rows);
}

std::string request_text(const SpecimenRequest& request) {
  return SpecimenJson{{"actuator", request.actuator},
                      {"first", request.first},
                      {"last", request.last},
                      {"experiment", request.experiment},
                      {"duration_s", request.duration_s},
                      {"model", request.model},
                      {"seed", request.seed}}
      .dump();
}

std::unique_ptr<SpecimenStudy> specimen_study(const StoredStudy& study) {
  try {
    const SpecimenJson json = SpecimenJson::parse(study.spec);
    return std::make_unique<SpecimenStudy>(SpecimenRequest{.actuator = json.at("actuator"),
                                                           .first = json.at("first"),
                                                           .last = json.at("last"),
                                                           .experiment = json.at("experiment"),
                                                           .duration_s = json.at("duration_s"),
                                                           .model = json.at("model"),
                                                           .seed = json.at("seed")});
  } catch (const SpecimenJson::exception&) {
    throw Error({.place = "study " + study.name,
                 .problem = "its specimens cannot be read",
                 .advice = "Use the torsio that began it: " + study.torsio_version + "."});
  }
}

}  // namespace torsio
