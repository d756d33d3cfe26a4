#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "fleet/calibration.hpp"
#include "fleet/fleet_text.hpp"
#include "fleet/registration.hpp"
#include "fleet/watch.hpp"
#include "fleet/watch_text.hpp"
#include "search/study_flags.hpp"
#include "store/store_flags.hpp"
#include "torsio/core/error.hpp"
#include "verbs.hpp"

namespace {

struct CalibrateFlags {
  torsio::FleetChoice fleet;
  bool promotes = false;
  WorkerFlags worker;
  JsonOutput json;
  std::string pages;
};

struct WatchFlags {
  std::string list;
  std::size_t threads = 0;
  StoreFlags store;
  ReportOutput report;
};

bool is_kept(const CalibrateFlags& flags) {
  return !flags.worker.store.empty() || !flags.worker.study.empty();
}

torsio::StoreAddress address_of(const CalibrateFlags& flags) {
  if (!is_kept(flags)) return {};
  if (!flags.worker.store.empty()) return torsio::store_address(flags.worker.store);
  const auto folder = std::filesystem::path(flags.fleet.list).parent_path();
  return torsio::store_address((folder / "torsio-studies.sqlite").string());
}

constexpr const char* kIndex = "index.html";

std::string path_in(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).string();
}

/// The page of all joints and one for each, to which it leads.
void write_pages(const std::string& folder, const torsio::FleetCalibration& fleet) {
  ReportOutput all;
  all.destination = path_in(folder, kIndex);
  for (const torsio::CalibratedJoint& joint : fleet.joints) {
    std::string file = joint.serial + ".html";
    std::ranges::replace(file, '/', '_');
    all.pages[joint.serial] = std::move(file);
  }
  all.write(torsio::fleet_report(fleet));
  for (std::size_t i = 0; i < fleet.joints.size(); ++i)
    write_text(path_in(folder, all.pages.at(fleet.joints[i].serial)),
               torsio::report_html(torsio::fleet_joint_report(fleet, i)));
  remark(fmt::format("a page for each of {} joints written to {}", fleet.joints.size(), folder));
}

std::string registered_text(const torsio::RegisteredFleet& added, const std::string& store,
                            bool promotes) {
  const bool is_one = added.models == 1;
  std::string text = fmt::format("{} {} in the registry of {}", added.models,
                                 is_one ? "model is" : "models are", store);
  if (!promotes)
    return text + (is_one ? "; --promote makes it current" : "; --promote makes them current");
  if (added.promoted > 0 || added.current_before == 0)
    text += fmt::format(", {} became current", added.promoted);
  if (added.current_before > 0)
    text += fmt::format(", {} {} current before", added.current_before,
                        added.current_before == 1 ? "was" : "were");
  return text;
}

void register_joints(const CalibrateFlags& flags, torsio::StudyStore& store,
                     const torsio::FleetCalibration& fleet,
                     const torsio::CalibrationRequest& request) {
  torsio::Registry registry(store.address(), wait_for_server);
  const torsio::RegisteredFleet added =
      torsio::register_fleet(registry, store, fleet, request, flags.promotes, person_here());
  remark(registered_text(added, store.address().name(), flags.promotes));
  for (const std::string& refused : added.refused) remark("not made current: " + refused);
  if (!added.not_compared.empty())
    remark(fmt::format(
        "made current without a comparison with other joints, of which {} of a type are needed: {}",
        torsio::kLeastMembers, fmt::join(added.not_compared, ", ")));
}

/// After all results are written: the exit code is that of `fleet watch`.
void require_models(const CalibrateFlags& flags, const torsio::FleetCalibration& fleet) {
  const auto failed = std::ranges::count_if(
      fleet.joints, [](const torsio::CalibratedJoint& joint) { return !joint.failure.empty(); });
  if (failed == 0) return;
  throw torsio::Error({.place = flags.fleet.list.empty() ? flags.fleet.specimens : flags.fleet.list,
                       .problem = fmt::format("{} of {} joints {}", failed, fleet.joints.size(),
                                              flags.fleet.only_compares ? "could not be compared"
                                              : failed == 1             ? "has no model"
                                                                        : "have no model")});
}

void calibrate(CalibrateFlags& flags) {
  const torsio::CalibrationRequest request = torsio::calibration_request(flags.fleet);
  if (flags.promotes && flags.fleet.only_compares)
    throw torsio::UsageError(
        {.place = "--promote",
         .problem = "--only-compare makes no models that could become current"});
  if (flags.promotes && !is_kept(flags))
    throw torsio::UsageError({.place = "--promote",
                              .problem = "models are made current in a store",
                              .advice = "Add --store FILE.sqlite."});
  // The work may take hours.
  DataFlags().check_outputs({flags.json.destination});
  if (!flags.pages.empty()) {
    make_folder(flags.pages);
    require_writable(path_in(flags.pages, kIndex));
  }
  torsio::CalibrationStudy kind(request);
  torsio::StudyStore store(address_of(flags), wait_for_server);
  const std::string name = flags.worker.study.empty() ? "calibrate" : flags.worker.study;
  const torsio::StoredStudy study = torsio::begin_calibration(store, name, kind);
  take_back_of_dead(store, study);
  if (!is_kept(flags)) remark("nothing is kept if this is stopped; --store FILE.sqlite keeps it");
  ProgressBar progress;
  torsio::run_workers(store, study, kind, flags.worker.options(), progress.listener());
  const torsio::FleetCalibration fleet = torsio::calibration_result(store, study);
  flags.json.write(torsio::fleet_json(fleet));
  if (flags.json.wants_tables()) print(torsio::fleet_text(fleet));
  if (is_kept(flags)) register_joints(flags, store, fleet, kind.request());
  if (!flags.pages.empty()) write_pages(flags.pages, fleet);
  require_models(flags, fleet);
}

void watch(WatchFlags& flags) {
  DataFlags().check_outputs(
      {flags.store.json.destination, flags.report.destination, flags.report.plot});
  const std::unique_ptr<torsio::Registry> registry = flags.store.open();
  std::vector<std::string> failures;
  if (!flags.list.empty()) {
    ProgressBar progress;
    failures = torsio::watch_joints(*registry, torsio::read_fleet_list(flags.list), flags.threads,
                                    progress.listener());
  }
  const std::vector<torsio::WatchedJoint> joints = torsio::rank_by_drift(*registry);
  flags.store.json.write(torsio::watch_json(joints, failures));
  if (flags.store.json.wants_tables()) print(torsio::watch_text(joints));
  for (const std::string& failure : failures) remark("not compared: " + failure);
  if (flags.report.is_wanted()) flags.report.write(torsio::watch_report(joints));
  if (!failures.empty())
    throw torsio::Error(
        {.place = flags.list,
         .problem = fmt::format("{} of its joints could not be compared", failures.size())});
}

}  // namespace

void add_fleet(CLI::App& app) {
  CLI::App* verb = app.add_subcommand(
      "fleet", "calibrate all joints of a robot or a production line, and watch their drift");
  verb->require_subcommand(1);
  verb->footer("docs/fleet.md: from the joints of one robot to a production line.");

  auto calibration = std::make_shared<CalibrateFlags>();
  CLI::App* part = verb->add_subcommand(
      "calibrate",
      "check, compare, transfer, fit and evaluate each joint; report those that differ");
  part->footer("Example: torsio fleet calibrate robot.yaml --store robot.sqlite --report pages");
  part->add_option("LIST", calibration->fleet.list, "joints with their recordings (docs/fleet.md)");
  part->add_option("--specimens", calibration->fleet.specimens,
                   "in place of a list: simulated specimens with their tolerances: "
                   "dfki-50#0001..#1000");
  part->add_option("--faults", calibration->fleet.faults,
                   "so many of the specimens get a fault of production");
  part->add_option("--base", calibration->fleet.base,
                   "model file that the joints are compared with and start from (default: the "
                   "list's, else for each type a model of its first joint)");
  part->add_option("--model", calibration->fleet.model, "family to fit (default grey_box)");
  add_seed(*part, calibration->fleet.seed, "seed of the fits and of the simulation");
  calibration->worker.add(*part,
                          "SQLite file or postgresql:// URL that keeps study, joints and models "
                          "(default: torsio-studies.sqlite beside the list, if --study is given)",
                          "name of the study (default calibrate)");
  part->add_flag("--only-compare", calibration->fleet.only_compares,
                 "make no models: only find the joints that differ, as at the end of a production "
                 "line");
  part->add_flag("--promote", calibration->promotes,
                 "make the models current of joints that do not differ from the others");
  part->add_option("--json", calibration->json.destination,
                   "write the results as JSON to a file, or - for standard output");
  part->add_option("--report", calibration->pages,
                   "write a page with all joints and one for each into this folder");
  part->callback([calibration] { calibrate(*calibration); });

  auto watching = std::make_shared<WatchFlags>();
  part = verb->add_subcommand("watch",
                              "compare new recordings with the current models, and rank "
                              "the joints by their drift");
  part->footer("Example: torsio fleet watch today.yaml --store robot.sqlite");
  part->add_option("LIST", watching->list,
                   "joints with their recordings of today; without it, the history is ranked");
  part->add_option("--threads", watching->threads,
                   "joints that are compared at the same time; the result does not depend on it "
                   "(default: one for each core that this process may use)")
      ->check(CLI::Range(0, 1024));
  watching->store.add(*part, "write the result as JSON to a file, or - for standard output");
  watching->report.add(*part);
  part->callback([watching] { watch(*watching); });
}
