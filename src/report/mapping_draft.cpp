#include "report/mapping_draft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data/names.hpp"
#include "report/json_text.hpp"
#include "report/plots.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

constexpr double kShown_s = 10.0;
constexpr std::size_t kPlotColumns = 64;
constexpr std::size_t kPlotRows = 8;

std::string coding_text(const ColumnGuess& guess) {
  std::string text;
  if (guess.sign < 0.0) text += "sign -1 ";
  if (guess.gear_ratio != 1.0) text += fmt::format("gear {:.6g} ", guess.gear_ratio);
  if (guess.holds) text += "hold ";
  if (!text.empty()) text.pop_back();
  return text;
}

/// What the draft makes of a column, over the rows of the first seconds.
struct DrawnColumn {
  std::string label;
  std::vector<double> values;
};

DrawnColumn drawn(const LogColumn& column, const ColumnGuess& guess, std::size_t rows) {
  const Unit* const unit = find_unit(guess.unit);
  DrawnColumn made{
      .label = fmt::format("{} from {}", guess.channel, printable(column.name)),
      .values = {column.values.begin(), column.values.begin() + static_cast<std::ptrdiff_t>(rows)}};
  for (double& value : made.values)
    value = guess.sign * (unit != nullptr ? unit->si(value) : value) / guess.gear_ratio;
  return made;
}

std::string picture_of(const LogTable& table, const MappingDraft& draft,
                       const std::vector<double>& time_s,
                       std::initializer_list<std::string_view> channels, const char* axis) {
  std::vector<DrawnColumn> columns;
  for (std::size_t i = 0; i < draft.columns.size(); ++i)
    if (draft.columns[i].is_written() &&
        std::ranges::find(channels, draft.columns[i].channel) != channels.end())
      columns.push_back(drawn(table.columns[i], draft.columns[i], time_s.size()));
  if (columns.empty()) return {};
  std::vector<Curve> curves;
  curves.reserve(columns.size());
  for (const DrawnColumn& column : columns)
    curves.push_back({.label = column.label, .x = time_s, .y = column.values});
  return terminal_plot(curves, {.x = "s", .y = axis}, kPlotColumns, kPlotRows);
}

/// From the first row on, in seconds.
std::vector<double> first_seconds(const LogTable& table, const MappingDraft& draft) {
  std::vector<double> time_s;
  for (std::size_t i = 0; i < draft.columns.size(); ++i) {
    if (draft.columns[i].channel != "t_s" || !draft.columns[i].is_written()) continue;
    const bool is_date = table.columns[i].time != TimeKind::none;
    const Unit* const unit = find_unit(is_date ? "s" : draft.columns[i].unit);
    for (const double stamp : table.columns[i].values) {
      const double since_s =
          (unit != nullptr ? unit->scale : 1.0) * (stamp - table.columns[i].values.front());
      if (!(since_s <= kShown_s)) break;
      time_s.push_back(since_s);
    }
    return time_s;
  }
  return time_s;
}

}  // namespace

std::string mapping_draft_text(const MappingDraft& draft) {
  TextTable table;
  table.header({"column", "channel", "unit", "as", "sure", "reasons"});
  std::size_t others = 0;
  for (const ColumnGuess& guess : draft.columns) {
    if (guess.channel.empty() && guess.missing.empty()) {
      ++others;
      continue;
    }
    std::string reasons;
    if (!guess.missing.empty())
      reasons = "left out, not shown by the data: " + guess.missing + "; ";
    for (const std::string& reason : guess.reasons) reasons += reason + "; ";
    if (!reasons.empty()) reasons.resize(reasons.size() - 2);
    table.row({printable(guess.summary.name), guess.is_written() ? guess.channel : "-",
               guess.unit.empty() ? "?" : guess.unit, coding_text(guess),
               guess.is_written() ? std::string(name(guess.certainty)) : "", reasons});
  }
  std::string text = table.text();
  if (others > 0) text += fmt::format("\n{} other columns: no guess\n", others);
  for (const std::string& left_out : draft.not_read) text += "not read: " + left_out + "\n";
  if (!draft.clock.empty()) text += fmt::format("clock: {}, {}\n", draft.clock, draft.clock_reason);
  for (const std::string& remark : draft.remarks) text += "missing: " + remark + "\n";
  if (!draft.refusal.empty())
    text += "a recording is not read with this draft yet: " + draft.refusal + "\n";
  return text;
}

std::string mapping_draft_json(const MappingDraft& draft) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  for (const ColumnGuess& guess : draft.columns)
    columns.push_back({{"column", guess.summary.name},
                       {"channel", guess.channel},
                       {"unit", guess.unit},
                       {"sign", guess.sign},
                       {"gear_ratio", guess.gear_ratio},
                       {"hold", guess.holds},
                       {"certainty", name(guess.certainty)},
                       {"written", guess.is_written()},
                       {"missing", guess.missing},
                       {"reasons", guess.reasons}});
  return json_text(nlohmann::ordered_json{{"file", draft.file},
                                          {"columns", std::move(columns)},
                                          {"clock", draft.clock},
                                          {"rate_Hz", draft.rate_Hz},
                                          {"not_read", draft.not_read},
                                          {"remarks", draft.remarks},
                                          {"refusal", draft.refusal},
                                          {"mapping", draft.yaml()}});
}

std::string mapping_draft_picture(const LogTable& table, const MappingDraft& draft) {
  const std::vector<double> time_s = first_seconds(table, draft);
  if (time_s.size() < 2) return {};
  return picture_of(
             table, draft, time_s,
             {"motor_angle_rad", "gear_angle_rad", "joint_angle_rad", "spring_deflection_rad"},
             "rad") +
         picture_of(table, draft, time_s, {"torque_Nm"}, "Nm");
}

}  // namespace torsio
