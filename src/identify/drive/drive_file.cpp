#include "torsio/identify/drive/drive_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "core/did_you_mean.hpp"
#include "files/json_object.hpp"
#include "files/json_text.hpp"
#include "files/whole_file.hpp"
#include "identify/drive/drive_document.hpp"
#include "identify/drive/sheet_json.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using DriveFileJson = nlohmann::ordered_json;

constexpr std::string_view kDriveFileAdvice =
    "Identify the drive again (torsio identify RECORDINGS --load load.yaml -o FILE).";
constexpr std::size_t kMaxDriveFileBytes = 16U << 20U;
constexpr double kShortestStep_s = 1e-6;  // a free run of a recording ends within seconds
constexpr double kLongestStep_s = 0.1;

DriveFileJson values_json(const DriveValues& values) {
  DriveFileJson document = DriveFileJson::object();
  for (const DriveParameterInfo& info : drive_parameters())
    if (at(values, info.parameter) != info.neutral)
      document[std::string(info.name)] = at(values, info.parameter);
  return document;
}

DriveFileJson parameters_json(const DriveIdentification& identified) {
  DriveFileJson list = DriveFileJson::array();
  for (const IdentifiedDriveParameter& parameter : identified.parameters)
    list.push_back(
        {{"name", drive_parameter_info(parameter.parameter).name},
         {"value", json_number(parameter.value)},
         {"standard_error", json_number(parameter.standard_error)},
         {"lowest_95", json_number(parameter.lowest)},
         {"highest_95", json_number(parameter.highest)},
         {"standard_error_from_load", json_number(parameter.from_load)},
         {"is_determined", parameter.is_determined ? DriveFileJson(*parameter.is_determined)
                                                   : DriveFileJson(nullptr)},
         {"is_at_bound", parameter.is_at_bound}});
  return list;
}

DriveFileJson scores_json(const DriveIdentification& identified) {
  DriveFileJson list = DriveFileJson::array();
  for (const DriveRecordingScore& score : identified.recordings)
    list.push_back({{"recording", score.recording},
                    {"group", score.group},
                    {"mae_rad", json_number(score.mae_rad)},
                    {"held_out_mae_rad", json_number(score.held_out_mae_rad)},
                    {"nested_mae_rad", json_number(score.nested_mae_rad)}});
  return list;
}

DriveFileJson structures_json(const DriveIdentification& identified) {
  DriveFileJson list = DriveFileJson::array();
  for (const StructureTrial& trial : identified.trials)
    list.push_back({{"terms", terms_text(trial.terms)},
                    {"change", trial.change},
                    {"held_out_mae_rad", json_number(trial.mae_rad)},
                    {"difference_standard_error_rad", json_number(trial.gain_error_rad)},
                    {"is_taken", trial.is_taken}});
  return list;
}

DriveFileJson findings_json(const DriveIdentification& identified) {
  DriveFileJson list = DriveFileJson::array();
  for (const DriveFinding& finding : identified.findings)
    list.push_back({{"status", finding.is_failure ? "FAIL" : "WARN"},
                    {"subject", finding.subject},
                    {"text", finding.text}});
  return list;
}

/// @throws Error naming the known names and the nearest one.
[[noreturn]] void refuse_drive_name(const std::string& place, const char* what,
                                    const std::string& found,
                                    const std::vector<std::string>& known) {
  throw Error({.place = place,
               .expected = fmt::format("{} of {}", what, fmt::join(known, ", ")),
               .found = fmt::format("'{}'", found),
               .advice = did_you_mean(found, known)});
}

DriveTerms terms_from(const std::string& text, const std::string& place) {
  DriveTerms terms = drive_terms({DriveTerm::base});
  if (text == "none") return terms;
  std::vector<std::string> known;
  for (std::size_t k = 1; k < kDriveTerms; ++k) known.emplace_back(name(static_cast<DriveTerm>(k)));
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(", ", begin), text.size());
    const std::string term = text.substr(begin, end - begin);
    const auto found = std::ranges::find(known, term);
    if (found == known.end()) refuse_drive_name(place, "terms", term, known);
    terms.set(static_cast<std::size_t>(found - known.begin()) + 1);
    begin = end + 2;
  }
  return terms;
}

DriveParameter parameter_from(const std::string& text, const std::string& place) {
  std::vector<std::string> known;
  for (const DriveParameterInfo& info : drive_parameters()) {
    if (info.name == text) return info.parameter;
    known.emplace_back(info.name);
  }
  refuse_drive_name(place, "a parameter", text, known);
}

/// Whether the equations divide by the value. An armature of 0 has no inertia of its own beside a spring.
bool divides(const DriveParameterInfo& info, const DriveTerms& terms) {
  using enum DriveParameter;
  const bool is_used = has(terms, info.term);
  switch (info.parameter) {
    case armature: return has(terms, DriveTerm::spring);
    case stiffness:
    case presliding: return is_used;
    default: return info.is_positive && info.neutral > 0.0;
  }
}

/// A value that is not in the file is neutral: its term is not used, or an earlier release did not have it.
DriveValues values_from(const JsonObject& document, const DriveTerms& terms,
                        const std::string& place) {
  DriveValues values = neutral_drive_values();
  for (const auto& [text, value] : document.number_map("values"))
    at(values, parameter_from(text, fmt::format("{}/values/{}", place, text))) = value;
  for (const DriveParameterInfo& info : drive_parameters()) {
    const double value = at(values, info.parameter);
    const bool must_be_positive = divides(info, terms);
    if (std::isfinite(value) && !(info.is_positive && value < 0.0) &&
        !(must_be_positive && value == 0.0))
      continue;
    throw Error({.place = fmt::format("{}/values/{}", place, info.name),
                 .expected = must_be_positive   ? "a finite number above 0"
                             : info.is_positive ? "a finite number, at least 0"
                                                : "a finite number",
                 .found = fmt::format("{}", value),
                 .advice = std::string(kDriveFileAdvice)});
  }
  return values;
}

IdentifiedDriveParameter parameter_row(const JsonObject& row, const std::string& place) {
  const bool has_interval = std::isfinite(row.number("standard_error"));
  return {
      .parameter = parameter_from(row.text("name"), place + "/parameters"),
      .value = row.number("value"),
      .standard_error = row.number("standard_error"),
      .lowest = row.number("lowest_95"),
      .highest = row.number("highest_95"),
      .from_load = row.number("standard_error_from_load"),
      .is_determined = has_interval ? std::optional(row.boolean("is_determined")) : std::nullopt,
      .is_at_bound = row.boolean("is_at_bound")};
}

void read_results(const JsonObject& document, const std::string& place,
                  DriveIdentification& identified) {
  identified.parameters = document.objects(
      "parameters", [&](const JsonObject& row) { return parameter_row(row, place); });
  identified.recordings = document.objects("recordings", [](const JsonObject& row) {
    return DriveRecordingScore{row.text("recording"), row.text("group"), row.number("mae_rad"),
                               row.number("held_out_mae_rad"), row.number("nested_mae_rad")};
  });
  identified.trials = document.objects("structures", [&](const JsonObject& row) {
    return StructureTrial{terms_from(row.text("terms"), place + "/structures"), row.text("change"),
                          row.number("held_out_mae_rad"),
                          row.number("difference_standard_error_rad"), row.boolean("is_taken")};
  });
  identified.findings = document.objects("findings", [](const JsonObject& row) {
    return DriveFinding{row.text("status") == "FAIL", row.text("subject"), row.text("text")};
  });
  if (document.has("error_gain"))
    identified.error_gain = document.object("error_gain", [](const JsonObject& of) {
      return MeasuredErrorGain{of.number("value_1_rad"), of.number("standard_error_1_rad"),
                               of.number("delay_s"), of.number("residual_duty_1"),
                               of.whole_number("samples")};
    });
}

/// Load and law are read as their files are, so that the same is refused.
void read_sheets(const nlohmann::json& parsed, const std::string& place,
                 DriveIdentification& identified) {
  for (const char* key : {"load_file", "drive_file"})
    if (!parsed.contains(key) || !parsed.at(key).is_object())
      throw Error({.place = fmt::format("{}/{}", place, key),
                   .expected = "an object",
                   .found = "none",
                   .advice = std::string(kDriveFileAdvice)});
  identified.load = parse_load_sheet(parsed.at("load_file").dump(), place);
  identified.drive = parse_drive_sheet(parsed.at("drive_file").dump(), place);
  if (identified.drive.law == DriveLaw::position && !identified.drive.error_gain_1_rad)
    throw Error({.place = place + "/drive_file/error_gain",
                 .expected = "the duty for an error of 1 rad at gain 1",
                 .found = "none",
                 .advice = std::string(kDriveFileAdvice)});
}

void require_drive_version(const JsonObject& document, const std::string& place) {
  const std::uint64_t version = document.whole_number("drive_format");
  if (version == kDriveFormatVersion) return;
  throw Error({.place = place + "/drive_format",
               .expected = fmt::format("{}, which this release reads", kDriveFormatVersion),
               .found = fmt::format("{}", version),
               .advice = "Read it with a later release, or identify the drive again."});
}

}  // namespace

std::string terms_text(const DriveTerms& terms) {
  std::string text;
  for (std::size_t k = 1; k < kDriveTerms; ++k)
    if (terms.test(k))
      text += fmt::format("{}{}", text.empty() ? "" : ", ", name(static_cast<DriveTerm>(k)));
  return text.empty() ? "none" : text;
}

DriveFileJson drive_document(const DriveIdentification& identified) {
  DriveFileJson document{{"drive_format", kDriveFormatVersion},
                         {"law", name(identified.drive.law)},
                         {"terms", terms_text(identified.terms)},
                         {"step_s", identified.step_s},
                         {"mae_rad", json_number(identified.mae_rad)},
                         {"rmse_rad", json_number(identified.rmse_rad)},
                         {"held_out_mae_rad", json_number(identified.held_out_mae_rad)},
                         {"nested_mae_rad", json_number(identified.nested_mae_rad)},
                         {"groups", identified.groups},
                         {"parameters", parameters_json(identified)},
                         {"recordings", scores_json(identified)},
                         {"structures", structures_json(identified)},
                         {"findings", findings_json(identified)},
                         {"values", values_json(identified.values)},
                         {"load_file", load_sheet_json(identified.load)},
                         {"drive_file", drive_sheet_json(identified.drive)}};
  if (identified.error_gain)
    document["error_gain"] = {
        {"value_1_rad", identified.error_gain->value_1_rad},
        {"standard_error_1_rad", json_number(identified.error_gain->standard_error_1_rad)},
        {"delay_s", identified.error_gain->delay_s},
        {"residual_duty_1", identified.error_gain->residual_duty_1},
        {"samples", identified.error_gain->samples}};
  return document;
}

std::string identified_drive_text(const DriveIdentification& identified) {
  return drive_document(identified).dump(2, ' ', false, DriveFileJson::error_handler_t::replace) +
         "\n";
}

void save_identified_drive(const std::filesystem::path& path,
                           const DriveIdentification& identified) {
  const std::string text = identified_drive_text(identified);
  write_whole_file(path, std::as_bytes(std::span(text)));
}

DriveIdentification parse_identified_drive(std::string_view text, const std::string& name) {
  const nlohmann::json parsed = parse_json(text, name, kDriveFileAdvice);
  const JsonObject document(parsed, name, kDriveFileAdvice);
  require_drive_version(document, name);
  DriveIdentification identified;
  identified.terms = terms_from(document.text("terms"), name + "/terms");
  identified.values = values_from(document, identified.terms, name);
  identified.step_s = document.number("step_s");
  if (!(identified.step_s >= kShortestStep_s && identified.step_s <= kLongestStep_s))
    throw Error({.place = name + "/step_s",
                 .expected = fmt::format("a step from {} to {} s", kShortestStep_s, kLongestStep_s),
                 .found = fmt::format("{}", identified.step_s),
                 .advice = std::string(kDriveFileAdvice)});
  identified.mae_rad = document.number("mae_rad");
  identified.rmse_rad = document.number("rmse_rad");
  identified.held_out_mae_rad = document.number("held_out_mae_rad");
  identified.nested_mae_rad = document.number("nested_mae_rad");
  identified.groups = document.whole_number("groups");
  read_results(document, name, identified);
  read_sheets(parsed, name, identified);
  return identified;
}

DriveIdentification read_identified_drive(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path, kMaxDriveFileBytes);
  return parse_identified_drive(
      std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), path.string());
}

}  // namespace torsio
