#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "published.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "tracking_models.hpp"

namespace torsio {
namespace {

using Kind = TorqueReference::Kind;

constexpr std::array kTrackedVariants{"maxwell-slip", "bouc-wen", "lugre"};
constexpr double kQuick_s = 20.0;
constexpr double kObserver_Hz = 8.0;  // loop with feed-forward and observer

/// The task of a loop (specification 6).
struct Task {
  const char* actuator;
  double amplitude_Nm;
  JointOutput output;
  bool is_helped = false;  ///< also by a loop with feed-forward of the rate and an observer
};
constexpr std::array kTasks{
    Task{"dfki-50", 13.0, JointOutput::locked, true}, Task{"dfki-50", 13.0, JointOutput::free},
    Task{"dfki-120", 20.0, JointOutput::locked, true}, Task{"dfki-120", 20.0, JointOutput::free},
    Task{"dfki-120", 70.0, JointOutput::locked}};

/// The families of this study; those that this build does not have are left out.
struct Learner {
  LoopFamily family;
  bool is_quick = false;  ///< also in the quick study
};
constexpr std::array kLearners{Learner{kLoopLine, true},        Learner{{"linear_coulomb"}},
                               Learner{{"polynomial"}, true},   Learner{{"maxwell_slip"}},
                               Learner{{"prandtl_ishlinskii"}}, Learner{{"grey_box"}},
                               Learner{kLoopMixture, true},     Learner{kLoopNetwork}};

bool exists(std::string_view family) {
  return std::ranges::any_of(families(),
                             [&](const FamilyInfo& info) { return info.name == family; });
}

/// Every family of this study on the same data.
std::vector<NamedInverse> all_learned(const Dataset& dataset, std::string_view trained_on,
                                      std::uint64_t seed, bool is_quick) {
  std::vector<NamedInverse> inverses;
  for (const Learner& learner : kLearners) {
    if (!exists(learner.family.name) || (is_quick && !learner.is_quick)) continue;
    inverses.push_back({fmt::format("{}, {}", learner.family.name, trained_on),
                        learned_inverse(learner.family, dataset, seed)});
  }
  return inverses;
}

/// Means over the runs of one model under one condition.
class TrackingRows {
 public:
  void add(const std::string& condition, const Task& task, Kind kind, const TrackingRow& run) {
    const auto found = std::ranges::find_if(sums_, [&](const Sum& sum) {
      return sum.row.condition == condition && sum.row.model == run.model;
    });
    Sum& sum = found != sums_.end() ? *found : begin(condition, task, kind, run);
    if (run.status != "ok") {
      ++sum.row.stopped;
      return;
    }
    if (run.score.limit_cycle) ++sum.row.limit_cycles;
    sum.mad.add(run.score.mad);
    sum.std_abs.add(run.score.std_abs);
    sum.rmse.add(run.score.rmse);
    sum.to_linear.add(run.mad_to_linear);
  }

  /// A condition that no joint of the kind can be under.
  void left_out(const std::string& condition, std::string_view reason) {
    std::string note = fmt::format("left out: {}: {}", condition, reason);
    if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
  }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

  [[nodiscard]] std::vector<LoopRow> rows() const {
    std::vector<LoopRow> all;
    for (const Sum& sum : sums_) {
      LoopRow& row = all.emplace_back(sum.row);
      row.runs = sum.rmse.count();
      row.rmse = sum.rmse.mean();
      row.rmse_std = sum.rmse.std_dev();
      row.mad = sum.mad.mean();
      row.mad_std = sum.mad.std_dev();
      row.std_abs = sum.std_abs.mean();
      row.mad_to_linear = sum.to_linear.mean();
    }
    return all;
  }

 private:
  struct Sum {
    LoopRow row;
    RunningMean mad = {}, std_abs = {}, rmse = {}, to_linear = {};
  };

  Sum& begin(const std::string& condition, const Task& task, Kind kind, const TrackingRow& run) {
    LoopRow row{StudyRow{.condition = condition, .model = run.model}};
    const std::string_view family = std::string_view(run.model).substr(0, run.model.find(','));
    // Whatever the friction of the spring and the output were: the papers do not print them.
    const std::string at =
        fmt::format("{}, {:g} Nm, {}", task.actuator, task.amplitude_Nm, name(kind));
    show_published(row, kPublishedTracking, at, family);
    return sums_.emplace_back(Sum{.row = std::move(row)});
  }

  std::vector<Sum> sums_;
  std::vector<std::string> notes_;
};

/// Everything that is tried on one task on one spring, with one seed.
struct Trial {
  const Task& task;
  const std::string& actuator;
  std::uint64_t seed;
  const LinearInverse& line;
  std::span<const NamedInverse> inverses;
  bool is_quick;
};

/// Both references, where rating and lever allow them.
void run_tests(const Trial& trial, bool is_helped, TrackingRows& rows, const Progress& progress) {
  const Task& task = trial.task;
  const DataSheet sheet = data_sheet(trial.actuator);
  for (const Kind kind : {Kind::chirp, Kind::random_walk}) {
    TrackingSpec spec{.output = task.output,
                      .reference = {.kind = kind, .amplitude_Nm = task.amplitude_Nm},
                      .feeds_rate_forward = is_helped,
                      .measures_bandwidth = false};
    if (is_helped) spec.observer_cutoff_Hz = kObserver_Hz;
    if (trial.is_quick) spec.reference.duration_s = kQuick_s;
    const std::array<std::uint64_t, 1> seeds{trial.seed + kFirstTestSeed};
    const std::string condition =
        fmt::format("{}, {:g} Nm {}, {}{}", trial.actuator, task.amplitude_Nm,
                    task.output == JointOutput::locked ? "locked" : "free", name(kind),
                    is_helped ? ", fed forward and observed" : "");
    try {
      check_tracking(sheet, spec, seeds.front());
    } catch (const UsageError& error) {  // beyond the rating, or the lever would tip over
      rows.left_out(condition, error.what());
      continue;
    }
    for (const TrackingRow& run :
         track_models(sheet, spec, trial.line, trial.inverses, seeds, progress))
      rows.add(condition, task, kind, run);
  }
}

/// One task on one spring, one repeat.
void run_task(const Task& task, const std::string& actuator, std::uint64_t seed,
              const StudyOptions& options, TrackingRows& rows, const Progress& progress) {
  Dataset dataset = sweep_dataset(actuator, seed, progress);
  std::vector<NamedInverse> inverses = all_learned(dataset, "sweeps", seed, options.is_quick);
  inverses.erase(inverses.begin());  // the line of the sweeps is run anyway
  const auto train_more = [&](Kind kind, std::string_view trained_on) {
    add_torque_mode(dataset,
                    {.actuator = actuator,
                     .amplitude_Nm = task.amplitude_Nm,
                     .output = task.output,
                     .kind = kind,
                     .seed = seed,
                     .duration_s = options.is_quick ? std::optional(kQuick_s) : std::nullopt});
    for (NamedInverse& more : all_learned(dataset, trained_on, seed, options.is_quick))
      inverses.push_back(std::move(more));
  };
  const auto of_sweeps = static_cast<std::ptrdiff_t>(inverses.size());
  train_more(Kind::chirp, "+ torque mode");
  const LinearInverse line = sweep_line(data_sheet(actuator), seed, progress);
  run_tests({task, actuator, seed, line, inverses, options.is_quick}, false, rows, progress);
  if (!task.is_helped) return;
  inverses.erase(inverses.begin(), inverses.begin() + of_sweeps);
  train_more(Kind::random_walk, "+ walks");
  run_tests({task, actuator, seed, line, inverses, options.is_quick}, true, rows, progress);
}

}  // namespace

Study torque_tracking_000(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "deflection control (50 rad/s) through the inverse of a model; trained on three sweeps, "
          "or also on chirps of 1.1 (free: 0.9), 0.5 and 0.25 times the amplitude under the linear "
          "controller (+ torque mode); tested on the chirp and on noise with its RMS, where the "
          "rating and the 0.8 m lever of a free output allow it; errors of the torque without "
          "sensor noise; fed forward and observed: with the rate of the reference torque fed "
          "forward and a disturbance observer of 8 Hz, trained also on such noise (+ walks)",
      .unit = "Nm",
      .options = options};
  const std::span<const Task> tasks = std::span(kTasks).first(options.is_quick ? 1 : kTasks.size());
  const std::size_t variants = options.is_quick ? 1 : kTrackedVariants.size();
  const std::size_t parts = tasks.size() * variants * options.repeats;
  TrackingRows rows;
  std::size_t done = 0;
  for (const Task& task : tasks) {
    for (std::size_t v = 0; v < variants; ++v) {
      const std::string actuator = fmt::format("{}:{}", task.actuator, kTrackedVariants[v]);
      const bool is_new = std::ranges::none_of(
          study.plants, [&](const StudyPlant& plant) { return plant.name == actuator; });
      if (is_new) study.plants.push_back(study_plant(actuator));
      for (std::size_t k = 0; k < options.repeats; ++k) {
        run_task(task, actuator, repeat_seed(options, k), options, rows,
                 nth_of(progress, done++, parts, actuator));
      }
    }
  }
  study.table = LoopTable{.rows = rows.rows()};
  study.notes = rows.notes();
  return study;
}

}  // namespace torsio
