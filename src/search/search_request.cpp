#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/load_roles.hpp"
#include "search/changed_recording.hpp"
#include "search/stored_path.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/joint_load/known_load.hpp"
#include "torsio/search/structure_study.hpp"

namespace torsio {
namespace {

using RequestJson = nlohmann::ordered_json;

std::vector<std::string> stored_paths(const std::vector<std::string>& paths) {
  std::vector<std::string> result;
  result.reserve(paths.size());
  for (const std::string& path : paths) result.push_back(stored_path(path));
  return result;
}

RequestJson request_json(const SearchRequest& request) {
  return {{"recordings", stored_paths(request.recordings)},
          {"validation", stored_paths(request.validation)},
          {"mapping", stored_path(request.mapping)},
          {"joint", request.joint},
          {"rate_Hz", request.rate_Hz},
          {"target", request.target},
          {"load_file", stored_path(request.load_file)},
          {"inputs", request.inputs},
          {"initialise", request.initialise},
          {"models", request.models},
          {"folds", request.settings.folds},
          {"seed", request.settings.seed},
          {"allow_leak", request.settings.allow_leak},
          {"halving", static_cast<int>(request.settings.halving)},
          {"halve_from_s", request.settings.halve_from_s}};
}

SearchRequest request_from(const RequestJson& json) {
  SearchRequest request{.recordings = json.at("recordings"),
                        .validation = json.at("validation"),
                        .mapping = json.at("mapping"),
                        .joint = json.at("joint"),
                        .rate_Hz = json.at("rate_Hz"),
                        .target = json.at("target"),
                        .load_file = json.at("load_file"),
                        .inputs = json.at("inputs"),
                        .initialise = json.at("initialise"),
                        .models = json.at("models")};
  request.settings = {.folds = json.at("folds"),
                      .seed = json.at("seed"),
                      .allow_leak = json.at("allow_leak"),
                      .halving = static_cast<Halving>(json.at("halving").get<int>()),
                      .halve_from_s = json.at("halve_from_s")};
  return request;
}

/// What the dataset of a study was made of: its files with their hashes, how they were read and cut.
RequestJson data_json(const Dataset& dataset) {
  RequestJson data = RequestJson::array();
  for (const DatasetRecord& record : dataset.records) {
    RequestJson roles = RequestJson::array();
    for (const Segment& segment : record.segments)
      roles.push_back({segment.begin, segment.end, name(segment.role)});
    data.push_back({{"file", stored_path(record.recording.source.file)},
                    {"sha256", record.recording.source.sha256},
                    {"mapping", record.recording.mapping},
                    {"roles", std::move(roles)}});
  }
  return data;
}

/// Refuses a study whose recordings are not those that it began with.
void refuse_changed(const RequestJson& before, const RequestJson& now) {
  if (before == now) return;
  for (std::size_t i = 0; i < std::min(before.size(), now.size()); ++i) {
    const bool is_file = before[i].at("file") == now[i].at("file");
    if (is_file && before[i] == now[i]) continue;
    const std::string file = now[i].at("file");
    if (is_file) refuse_changed_recording(file, before[i].at("sha256"), now[i].at("sha256"));
    throw Error({.place = file,
                 .problem = "this recording is read in another way than when the study began "
                            "(mapping, roles or order)",
                 .advice = "Restore the file, or begin a study with another name."});
  }
  throw Error({.place = "study",
               .problem = "the number of its recordings has changed since it began",
               .expected = std::to_string(before.size()),
               .found = std::to_string(now.size())});
}

}  // namespace

Dataset load_search_data(const SearchRequest& request, const Progress& progress) {
  LoadOptions options;
  options.progress = progress;
  if (!request.mapping.empty()) options.mapping = request.mapping;
  options.joint = request.joint;
  if (request.rate_Hz > 0.0) options.rate_Hz = request.rate_Hz;
  options.target = request.target;
  options.computes_target = !request.load_file.empty();
  Dataset dataset = load_with_validation(request.recordings, request.validation, {}, options);
  dataset.initialise_samples = request.initialise;
  if (!request.load_file.empty()) {
    const std::vector<std::string> first =
        request.inputs.empty() ? std::vector<std::string>{} : request.inputs.front();
    add_load_target(dataset, read_load_sheet(request.load_file), resolve_inputs(dataset, first),
                    {});
  }
  dataset.check();
  return dataset;
}

std::vector<ModelChoice> search_choices(const Dataset& dataset, const SearchRequest& request) {
  const auto choices_of = [&](const std::vector<std::string>& inputs) {
    return request.models == kSearch ? search_candidates(dataset, inputs)
                                     : model_choices(dataset, request.models, inputs);
  };
  if (request.inputs.size() < 2)
    return choices_of(request.inputs.empty() ? std::vector<std::string>{} : request.inputs.front());
  std::vector<ModelChoice> all;
  for (std::size_t i = 0; i < request.inputs.size(); ++i)
    for (ModelChoice& choice : choices_of(request.inputs[i])) {
      choice.input_set = fmt::format("set {}", i + 1);
      all.push_back(std::move(choice));
    }
  return all;
}

std::string request_text(const SearchRequest& request, const Dataset& dataset) {
  RequestJson json = request_json(request);
  json["data"] = data_json(dataset);
  return json.dump();
}

void refuse_changed_data(const StoredStudy& study, const Dataset& dataset) {
  refuse_changed(RequestJson::parse(study.spec).at("data"), data_json(dataset));
}

std::unique_ptr<StructureStudy> structure_study(const StoredStudy& study,
                                                const Progress& progress) {
  SearchRequest request;
  try {
    request = request_from(RequestJson::parse(study.spec));
  } catch (const RequestJson::exception&) {
    throw Error({.place = "study " + study.name,
                 .problem = "what it searches cannot be read",
                 .advice = "Use the torsio that began it: " + study.torsio_version + "."});
  }
  Dataset dataset = load_search_data(request, progress);
  refuse_changed_data(study, dataset);
  std::vector<ModelChoice> choices = search_choices(dataset, request);
  return std::make_unique<StructureStudy>(std::move(dataset), std::move(choices), request.settings);
}

}  // namespace torsio
