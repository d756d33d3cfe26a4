#include "studies/study_cache.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "core/fnv_hash.hpp"
#include "files/whole_file.hpp"
#include "torsio/core/error.hpp"

namespace torsio {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReportAxis, label, is_logarithmic)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(XySeries, label, style, role, is_shown, x, y, colour, names)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(XyFigure, title, x, y, series, is_equal, colour_label)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DetailWindow, begin, end, label)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TimeMark, begin_s, end_s, label, is_failure)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TimeSeries, label, role, is_shown, overview, detail)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TimeFigure::Panel, label, series)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TimeFigure, title, start_s, rate_Hz, samples, bucket, windows,
                                   marks, panels)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FieldFigure::Area, corners, value)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FieldFigure, title, value_label, highest, areas)

namespace {

constexpr auto kOutcomeFormat = "torsio study";
constexpr int kOutcomeVersion = 1;
constexpr std::size_t kMaxOutcomeBytes = std::size_t{256} << 20U;
constexpr std::size_t kMaxProgramBytes = std::size_t{4} << 30U;

template <class Figure>
void add_figure(nlohmann::json& figures, const char* kind, const Figure& figure) {
  figures.push_back({{"kind", kind}, {"figure", figure}});
}

nlohmann::json figures_json(const std::vector<ReportFigure>& figures) {
  auto all = nlohmann::json::array();
  for (const ReportFigure& figure : figures) {
    if (const auto* const plane = std::get_if<XyFigure>(&figure)) add_figure(all, "xy", *plane);
    if (const auto* const time = std::get_if<TimeFigure>(&figure)) add_figure(all, "time", *time);
    if (const auto* const field = std::get_if<FieldFigure>(&figure))
      add_figure(all, "field", *field);
  }
  return all;
}

ReportFigure figure_of(const nlohmann::json& entry) {
  const auto kind = entry.at("kind").get<std::string>();
  if (kind == "time") return entry.at("figure").get<TimeFigure>();
  if (kind == "field") return entry.at("figure").get<FieldFigure>();
  return entry.at("figure").get<XyFigure>();
}

}  // namespace

StudyCache::StudyCache(std::filesystem::path folder, std::uint64_t program)
    : folder_(std::move(folder)), program_(program) {}

std::filesystem::path StudyCache::path_of(const StudyInfo& study,
                                          const StudyOptions& options) const {
  return folder_ / fmt::format("{}-seed{}-repeats{}{}.cbor", study.name, options.seed,
                               options.repeats, options.is_quick ? "-quick" : "");
}

std::optional<StudyOutcome> StudyCache::find(const StudyInfo& study,
                                             const StudyOptions& options) const {
  const std::filesystem::path path = path_of(study, options);
  std::error_code missing;
  if (study.must_be_named || !std::filesystem::exists(path, missing)) return std::nullopt;
  const std::vector<std::byte> bytes = read_whole_file(path, kMaxOutcomeBytes);
  try {
    const nlohmann::json document = nlohmann::json::from_cbor(bytes);
    if (document.at("format") != kOutcomeFormat || document.at("format_version") != kOutcomeVersion)
      throw Error({.place = path.string(),
                   .expected = fmt::format("an outcome of a study of format {}", kOutcomeVersion),
                   .found = "another format"});
    if (document.at("program").get<std::uint64_t>() != program_) return std::nullopt;
    StudyOutcome outcome{.text = document.at("text"),
                         .json = document.at("json"),
                         .figure_columns = document.at("figure_columns"),
                         .seconds = document.at("seconds")};
    for (const nlohmann::json& entry : document.at("figures"))
      outcome.figures.push_back(figure_of(entry));
    return outcome;
  } catch (const nlohmann::json::exception&) {
    throw Error(
        {.place = path.string(), .expected = "an outcome of a study", .found = "a damaged file"});
  }
}

void StudyCache::keep(const StudyInfo& study, const StudyOptions& options,
                      const StudyOutcome& outcome) const {
  if (study.must_be_named) return;
  const std::filesystem::path path = path_of(study, options);
  std::error_code failed;
  std::filesystem::create_directories(folder_, failed);
  if (failed)
    throw Error({.place = folder_.string(),
                 .problem = "the folder cannot be created: " + failed.message()});
  const std::vector<std::uint8_t> bytes =
      nlohmann::json::to_cbor({{"format", kOutcomeFormat},
                               {"format_version", kOutcomeVersion},
                               {"program", program_},
                               {"text", outcome.text},
                               {"json", outcome.json},
                               {"figures", figures_json(outcome.figures)},
                               {"figure_columns", outcome.figure_columns},
                               {"seconds", outcome.seconds}});
  write_whole_file(path, std::as_bytes(std::span(bytes)));
}

std::filesystem::path study_cache_folder() {
  for (const auto& [variable, below] :
       {std::pair{"XDG_CACHE_HOME", ""}, std::pair{"HOME", ".cache"}}) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): the environment is not written
    const char* const value = std::getenv(variable);
    // A relative folder would be another one in each working directory.
    if (value != nullptr && value[0] == '/')
      return std::filesystem::path(value) / below / "torsio" / "studies";
  }
  return {};
}

std::uint64_t running_program_hash() {
  const std::vector<std::byte> bytes =
      read_whole_file(std::filesystem::canonical("/proc/self/exe"), kMaxProgramBytes);
  FnvHash hash;
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min(sizeof(word), bytes.size() - at));
    hash.add(word);
  }
  return hash.value();
}

}  // namespace torsio
