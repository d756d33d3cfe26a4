#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "studies/board_data.hpp"
#include "studies/board_run.hpp"
#include "studies/studies.hpp"
#include "studies/study_models.hpp"
#include "studies/study_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/identify/drive/write_drive.hpp"

namespace torsio {
namespace {

/// The sets of one dataset, whose fits are the same.
struct BoardGroup {
  std::string_view data;
  std::vector<const BoardSet*> sets;
};

std::vector<BoardGroup> board_groups() {
  std::vector<BoardGroup> groups;
  for (const BoardSet& set : board_sets()) {
    if (groups.empty() || groups.back().data != set.data) groups.push_back({set.data, {}});
    groups.back().sets.push_back(&set);
  }
  return groups;
}

std::vector<BenchmarkModel> models_of(std::string_view data) {
  if (data == "boucwen") return {kBoucWenModels.begin(), kBoucWenModels.end()};
  if (data == "emps") return {kEmpsModels.begin(), kEmpsModels.end()};
  std::vector<BenchmarkModel> models;
  if (data == "xl330") return models;
  models.reserve(kComparedFamilies.size());
  for (const ComparedFamily& family : kComparedFamilies)
    models.push_back({.name = family.label,
                      .choice = family.model,
                      .quick = family.is_quick ? family.model : std::string_view{}});
  return models;
}

/// Fields of a file of rows have neither commas nor quotes, nor the end of a cell in a table of a page.
std::string as_field(std::string_view text) {
  std::string field(text.substr(0, text.find('\n')));
  for (char& letter : field) {
    if (letter == ',') letter = ';';
    if (letter == '"' || letter == '\\' || letter == '|') letter = '\'';
  }
  return field;
}

/// The errors of one model on one set, over its runs.
struct BoardErrors {
  RunningMean error;
  std::size_t samples = 0;
  std::size_t without = 0;
  std::size_t diverged = 0;  ///< samples at which the model diverged, of all runs
};

/// Share of the scored samples without an estimate from which on a model has no row.
constexpr double kLeastShareWithout = 0.1;

BoardRow row_of(const BoardSet& set, std::string_view model, const BoardErrors& errors,
                const std::string& failure) {
  const std::size_t scored = errors.samples + errors.without;
  // An error of the other samples would be of another condition.
  const bool is_incomplete =
      kLeastShareWithout * static_cast<double>(scored) < static_cast<double>(errors.without);
  BoardRow row =
      measured_row(set.name, board_model_name(model), BoardOrigin::measured,
                   failure.empty() && !is_incomplete ? errors.error.mean() : kNotMeasured);
  row.runs = std::max<std::size_t>(errors.error.count(), 1);
  if (row.runs > 1 && !is_incomplete) row.spread = errors.error.std_dev();
  if (!failure.empty()) row.remark = "failed: " + as_field(failure);
  if (errors.diverged > 0)
    row.remark =
        fmt::format("diverged at {} samples: those of its guard are scored", errors.diverged);
  if (is_incomplete)
    row.remark = fmt::format(
        "no estimate at {} of {} scored samples: it warms up for as long as its start matters",
        errors.without, scored);
  else if (errors.without > 0 && row.remark.empty())
    row.remark = fmt::format("{} samples are not scored: filters had not settled", errors.without);
  return row;
}

/// One trained model through the test recordings of its sets.
class BoardFits {
 public:
  BoardFits(const BoardGroup& group, const ComparisonCase& data)
      : group_(group), data_(data), errors_(group.sets.size()) {
    for (const BoardSet* set : group.sets) targets_.push_back(board_targets(*set, data.dataset));
  }

  void add(const Estimator& estimator) {
    for (std::size_t s = 0; s < group_.sets.size(); ++s) {
      std::vector<std::vector<double>> predictions;
      for (const BoardTarget& target : targets_[s])
        predictions.push_back(run(estimator, target, errors_[s]));
      const BoardScore score = board_score(*group_.sets[s], targets_[s], predictions);
      errors_[s].error.add(score.error);
      errors_[s].samples = score.samples;
      errors_[s].without = score.without;
    }
  }

  [[nodiscard]] std::vector<BoardRow> rows(std::string_view model,
                                           const std::string& failure) const {
    std::vector<BoardRow> rows;
    for (std::size_t s = 0; s < group_.sets.size(); ++s)
      rows.push_back(row_of(*group_.sets[s], model, errors_[s], failure));
    return rows;
  }

 private:
  [[nodiscard]] std::vector<double> run(const Estimator& estimator, const BoardTarget& target,
                                        BoardErrors& errors) const {
    const auto record = std::ranges::find_if(data_.dataset.records, [&](const auto& each) {
      return each.recording.name() == target.recording;
    });
    const ScoredRun run = scored_run(estimator, data_.dataset, *record);
    std::vector<double> values;
    values.reserve(target.samples.size());
    for (const std::size_t sample : target.samples) {
      const Estimate& estimate = run.prediction.estimates[sample];
      const bool has_value = estimate.fault != Fault::warming_up;
      values.push_back(has_value ? estimate.value : kNotMeasured);
      if (estimate.fault == Fault::diverged || estimate.fault == Fault::model_not_finite)
        ++errors.diverged;
    }
    return values;
  }

  const BoardGroup& group_;
  const ComparisonCase& data_;
  std::vector<std::vector<BoardTarget>> targets_;
  std::vector<BoardErrors> errors_;
};

/// The choice of `--models` with the scheduling input of the data, where the family has one.
ModelChoice choice_of(const ComparisonCase& data, std::string_view model) {
  std::string choice(model);
  if (!data.schedule.empty() &&
      has_option(find_family(model.substr(0, model.find(':'))), "schedule"))
    choice += ":schedule=" + data.schedule;
  return model_choices(data.dataset, choice, data.inputs).front();
}

void add_fits(const BoardGroup& group, const StudyOptions& options, const Progress& progress,
              std::vector<BoardRow>& rows) {
  const ComparisonCase data = board_case(*group.sets.front(), progress);
  const std::vector<BenchmarkModel> models = models_of(group.data);
  for (std::size_t m = 0; m < models.size(); ++m) {
    const BenchmarkModel& model = models[m];
    const std::string_view choice = options.is_quick ? model.quick : model.choice;
    if (choice.empty()) continue;
    BoardFits fits(group, data);
    std::string failure;
    const std::size_t repeats = model.is_seeded ? options.repeats : 1;
    for (std::size_t k = 0; k < repeats && failure.empty(); ++k) {
      const Progress part = nth_of(progress, m * repeats + k, models.size() * repeats,
                                   fmt::format("{}, {}", group.sets.front()->name, model.name));
      try {
        const TrainedModel trained =
            train_model(data.dataset, choice_of(data, choice), repeat_seed(options, k), part);
        fits.add(make_estimator(trained.file));
      } catch (const UsageError&) {
        throw;
      } catch (const Cancelled&) {
        throw;
      } catch (const Error& error) {
        failure = error.what();
      }
    }
    std::ranges::move(fits.rows(model.name, failure), std::back_inserter(rows));
  }
}

/// Free runs of a servo at a gain that was left out.
void add_servo(const BoardSet& set, const StudyOptions& options, const Progress& progress,
               std::vector<BoardRow>& rows) {
  const ComparisonCase data = board_case(set, progress);
  std::vector<Recording> recordings;
  for (const DatasetRecord& record : data.dataset.records) recordings.push_back(record.recording);
  const LoadSheet load = parse_load_sheet(
      "load: {pendulum: {mass: mass_kg, length: length_m, arm_mass: arm_mass_kg}}", "load.yaml");
  const DriveSheet drive = assumed_drive_sheet(recordings.front());
  const IdentifyOptions identify{
      .group_by = "kp_1", .has_standard_errors = false, .seed = options.seed, .progress = progress};
  const auto add = [&](std::string_view model, double error) {
    rows.push_back(measured_row(set.name, model, BoardOrigin::measured, error));
  };
  DriveIdentification found = identify_drive(recordings, load, drive, identify);
  add("identify; terms chosen within the three gains", found.nested_mae_rad);
  std::vector<std::vector<double>> predictions;
  const std::vector<BoardTarget> targets = board_targets(set, data.dataset);
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    found.values = found.held_out_values[k];
    const DriveTrace trace = simulate_drive(found, recordings[k]);
    std::vector<double>& values = predictions.emplace_back();
    for (const std::size_t sample : targets[k].samples)
      values.push_back(trace.joint_angle_rad[sample]);
  }
  add("identify; terms chosen by all gains", board_score(set, targets, predictions).error);
  rows.back().remark =
      "another condition: its terms were also chosen by the gain that was left out";
  for (const BamComparison& bam : compare_with_bam(found, recordings, {.seed = options.seed}))
    add(fmt::format("BAM {} by the search of identify", bam.model), bam.held_out_mae_rad);
}

}  // namespace

std::string board_model_name(std::string_view name) {
  std::string text(name);
  std::ranges::replace(text, ',', ';');
  return text;
}

std::vector<std::string> board_settings() {
  std::vector<std::string> settings;
  for (const std::string_view data : {"boucwen", "emps", ""})
    for (const BenchmarkModel& model : models_of(data))
      if (model.choice != model.name)
        settings.push_back(fmt::format("{}, {}: {}", data.empty() ? "desr and cycloidal" : data,
                                       board_model_name(model.name), model.choice));
  return settings;
}

BoardRun run_board(const StudyOptions& options, const Progress& progress) {
  BoardRun run;
  const std::string folder = board_folder();
  const std::vector<BoardGroup> groups = board_groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const BoardGroup& group = groups[g];
    const BoardSet& first = *group.sets.front();
    const Progress part = nth_of(progress, g, groups.size(), first.name);
    std::string reason = why_left_out(source_of(first), folder);
    if (reason.empty() && options.is_quick && group.data == "xl330")
      reason = "not part of the quick run";
    if (!reason.empty())
      for (const BoardSet* set : group.sets)
        run.left_out.push_back(fmt::format("{}: {}", set->name, reason));
    else if (group.data == "xl330")
      add_servo(first, options, part, run.rows);
    else
      add_fits(group, options, part, run.rows);
  }
  return run;
}

Study board_study(const StudyOptions& options, const BoardRun& run) {
  Study study{.protocol =
                  "public recordings of actuators, free run: published figures and every "
                  "family that suits; docs/board.md describes the sets, and how to join",
              .unit = {},
              .options = options};
  std::vector<BoardRow> rows = run.rows;
  std::ranges::move(published_board_rows(), std::back_inserter(rows));
  QuantityTable table;
  for (const BoardSet& set : board_sets()) {
    const bool is_run = std::ranges::find(run.rows, set.name, &BoardRow::set) != run.rows.end();
    if (!is_run) continue;
    for (const BoardRow& row : rows_of(set, rows)) {
      const std::string own_spread = spread_text(row);
      const std::string spread = own_spread.empty()
                                     ? std::string()
                                     : fmt::format(", +- {} over {} runs", own_spread, row.runs);
      table.rows.push_back({.condition = std::string(set.name),
                            .quantity = row.model,
                            .value = row.error,
                            .unit = fmt::format("{} ({})", set.unit, name(set.measure)),
                            .remark = fmt::format("{}{}{}{}", name(row.origin), spread,
                                                  row.remark.empty() ? "" : ": ", row.remark)});
    }
  }
  study.table = std::move(table);
  study.notes = run.left_out;
  for (std::string& note : study.notes) note.insert(0, "left out: ");
  for (const std::string& setting : board_settings()) study.notes.push_back(setting);
  return study;
}

Study board(const StudyOptions& options, const Progress& progress) {
  return board_study(options, run_board(options, progress));
}

}  // namespace torsio
