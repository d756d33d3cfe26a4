#include "report/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "identify/drive/drive_document.hpp"
#include "report/drive_advice_json.hpp"
#include "report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using DriveJson = nlohmann::ordered_json;

std::string number_or_dash(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}
std::string angle_text(double value_rad) {
  return std::isfinite(value_rad) ? fmt::format("{:.4f}", value_rad) : "-";
}

std::string structure_text(const DriveIdentification& identified) {
  if (identified.trials.empty())
    return fmt::format("terms beyond the base: {} (stated)\n", terms_text(identified.terms));
  std::string steps;
  for (const StructureTrial& trial : identified.trials)
    if (trial.is_taken)
      steps += fmt::format("{}{} {:.4f}", steps.empty() ? "" : ", ", trial.change, trial.mae_rad);
  return fmt::format("terms beyond the base: {} (chosen by held-out error in rad: {})\n",
                     terms_text(identified.terms), steps);
}

std::string findings_text(const std::vector<DriveFinding>& findings) {
  std::string text;
  for (const DriveFinding& finding : findings)
    text += fmt::format("{} {}: {}\n", finding.is_failure ? "FAIL" : "WARN", finding.subject,
                        finding.text);
  return text.empty() ? text : text + "\n";
}

std::string error_gain_text(const DriveIdentification& identified) {
  if (!identified.error_gain) return {};
  return fmt::format(
      "error_gain measured from the duty: {:.5g} for 1 rad at gain 1, {:.0f} ms after the goal, "
      "residual {:.2g} (RMS of the duty)\n",
      identified.error_gain->value_1_rad, 1e3 * identified.error_gain->delay_s,
      identified.error_gain->residual_duty_1);
}

std::string standard_error_text(const DriveIdentification& identified) {
  if (!has_standard_errors(identified))
    return "standard errors: none, so that it is not known which parameters these recordings "
           "determine. They need three\nrecordings, and fits without each of them.\n";
  return fmt::format(
      "standard errors: from fits without one recording each ({} recordings, Student's t), and "
      "from the uncertainty of the load.\nThey do not contain what is wrong in all recordings "
      "alike, such as the stated supply.\n",
      identified.recordings.size());
}

}  // namespace

bool has_standard_errors(const DriveIdentification& identified) {
  return std::ranges::any_of(identified.parameters, [](const IdentifiedDriveParameter& parameter) {
    return parameter.is_determined.has_value();
  });
}

TextTable drive_parameter_table(const DriveIdentification& identified) {
  TextTable table;
  table.header({"parameter", "value", "standard error", "95 % interval", "what it is"});
  for (const IdentifiedDriveParameter& parameter : identified.parameters) {
    const DriveParameterInfo& info = drive_parameter_info(parameter.parameter);
    std::string note(info.meaning);
    if (parameter.is_at_bound) note += " (at its bound)";
    if (parameter.is_determined == false) note += " (not determined)";
    table.row({std::string(info.name), number_or_dash(parameter.value),
               number_or_dash(parameter.standard_error),
               std::isfinite(parameter.lowest)
                   ? fmt::format("{:.4g} to {:.4g}", parameter.lowest, parameter.highest)
                   : "-",
               note});
  }
  return table;
}

TextTable drive_score_table(const DriveIdentification& identified) {
  TextTable table;
  if (identified.groups == 0) {
    table.header({"recording", "error [rad]"});
    for (const DriveRecordingScore& score : identified.recordings)
      table.row({score.recording, angle_text(score.mae_rad)});
    table.row({"mean", angle_text(identified.mae_rad)});
    return table;
  }
  table.header({"recording", "group", "fitted [rad]", "held out [rad]", "nested [rad]"});
  for (const DriveRecordingScore& score : identified.recordings)
    table.row({score.recording, score.group, angle_text(score.mae_rad),
               angle_text(score.held_out_mae_rad), angle_text(score.nested_mae_rad)});
  table.row({"mean", "", angle_text(identified.mae_rad), angle_text(identified.held_out_mae_rad),
             angle_text(identified.nested_mae_rad)});
  return table;
}

std::string drive_evaluation_text(const DriveIdentification& evaluated) {
  return drive_score_table(evaluated).text() +
         fmt::format(
             "mean |measured - simulated angle| in free runs from the command alone, RMSE {:.4f} "
             "rad; nothing was fitted here.\n",
             evaluated.rmse_rad);
}

std::string identification_text(const DriveIdentification& identified) {
  std::string text = findings_text(identified.findings);
  text += drive_parameter_table(identified).text() + "\n" + drive_score_table(identified).text();
  text +=
      "mean |measured - simulated angle| in free runs from the command alone. held out: fitted "
      "without the recording's group;\nnested: the terms were chosen without it, too. Of these "
      "three only the last one chose nothing by what it scores.\n\n";
  return text + structure_text(identified) + error_gain_text(identified) +
         standard_error_text(identified);
}

TextTable drive_advice_table(const std::vector<DriveAdvice>& advice) {
  TextTable table;
  table.header({"next recording", "lowers the standard error of", "to"});
  for (const DriveAdvice& row : advice)
    table.row({row.recording, std::string(drive_parameter_info(row.parameter).name),
               fmt::format("{:.0f} %", 100.0 * row.standard_error_ratio)});
  return table;
}

std::string drive_advice_text(const std::vector<DriveAdvice>& advice) {
  return drive_advice_table(advice).text();
}

DriveJson drive_advice_json(const std::vector<DriveAdvice>& advice) {
  DriveJson list = DriveJson::array();
  for (const DriveAdvice& row : advice)
    list.push_back({{"recording", row.recording},
                    {"parameter", drive_parameter_info(row.parameter).name},
                    {"standard_error_ratio", row.standard_error_ratio}});
  return list;
}

std::string identification_json(const DriveIdentification& identified,
                                const std::vector<DriveAdvice>& advice) {
  DriveJson document = drive_document(identified);
  if (!advice.empty()) document["advice"] = drive_advice_json(advice);
  return json_text(document);
}

}  // namespace torsio
