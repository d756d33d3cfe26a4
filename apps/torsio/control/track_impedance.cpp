#include "control/track_impedance.hpp"

#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/write.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace {

using torsio::ImpedanceSpec;

double stiffness_of(const std::string& text) {
  try {
    return torsio::signed_quantity_with_unit(text, "Nm_rad", "--impedance");
  } catch (const torsio::UsageError& error) {
    torsio::ErrorReport report = error.report();
    report.expected = "high, zero or a stiffness such as 2000Nm_rad";
    throw torsio::UsageError(std::move(report));
  }
}

ImpedanceSpec spec_of(const ImpedanceFlags& flags, const SharedTrackFlags& shared) {
  ImpedanceSpec spec;
  if (flags.impedance == "zero") {
    spec.kind = ImpedanceSpec::Kind::zero;
  } else if (flags.impedance != "high") {
    spec.kind = ImpedanceSpec::Kind::wanted;
    spec.stiffness_Nm_rad = stiffness_of(flags.impedance);
  }
  const auto set = [](double& value, const std::string& text, const char* unit, const char* flag) {
    if (!text.empty()) value = torsio::signed_quantity_with_unit(text, unit, flag);
  };
  set(spec.damping_Nms_rad, flags.damping, "Nms_rad", "--impedance-damping");
  const auto set_optional = [](std::optional<double>& value, const std::string& text,
                               const char* unit, const char* flag) {
    if (!text.empty()) value = torsio::signed_quantity_with_unit(text, unit, flag);
  };
  set_optional(spec.torque_gain_Nm_rad, flags.torque_gain, "Nm_rad", "--torque-gain");
  set_optional(spec.amplitude_Nm, shared.amplitude, "Nm", "--amplitude");
  set(spec.duration_s, shared.duration, "s", "--duration");
  if (!shared.bandwidth.empty())
    spec.bandwidth_rad_s = angular_frequency_rad_s(shared.bandwidth, "--bandwidth");
  if (shared.loop_damping) spec.loop_damping = above_zero(*shared.loop_damping, "--damping");
  if (!flags.correction.empty())
    spec.correction_rad_s = angular_frequency_rad_s(flags.correction, "--correction");
  return spec;
}

torsio::ImpedanceModel model_of(const std::string& path, const torsio::DataSheet& sheet) {
  try {
    return torsio::impedance_model(path, torsio::load_model(path), sheet);
  } catch (const torsio::UsageError&) {
    throw;
  } catch (const torsio::Error& error) {
    torsio::ErrorReport report = error.report();
    if (!report.place.starts_with(path)) report.place = path + ": " + report.place;
    throw torsio::UsageError(std::move(report));
  }
}

std::vector<torsio::ImpedanceModel> models_of(const std::vector<std::string>& paths,
                                              const torsio::DataSheet& sheet) {
  std::vector<torsio::ImpedanceModel> models;
  for (const std::string& path : paths)
    if (path != torsio::kSweepLineName) models.push_back(model_of(path, sheet));
  return models;
}

void warn_of_other_springs(const std::vector<torsio::ImpedanceModel>& models,
                           const torsio::DataSheet& sheet, const ImpedanceSpec& spec,
                           const torsio::Progress& progress) {
  std::optional<torsio::LinearInverse> linear;
  for (const torsio::ImpedanceModel& model : models) {
    const auto* const inverse = std::get_if<torsio::AnyInverse>(&model.use);
    if (inverse == nullptr) continue;
    if (!linear) linear = torsio::spring_line(sheet, kDefaultSeed, progress);
    constexpr double kShare = 0.1;  // as half the amplitude that `ImpedanceSpec` has by default
    warn_of_another_spring(
        model.name, *inverse, *linear, sheet,
        spec.amplitude_Nm ? 0.5 * *spec.amplitude_Nm : kShare * sheet.rating.torque_Nm.value);
  }
}

}  // namespace

void ImpedanceFlags::add(CLI::App& verb) {
  verb.add_option("--impedance", impedance,
                  "impedance control instead of the torque loop: a stiffness, 2000Nm_rad, zero, or "
                  "for harmonic-drive high (gains of paper 004)");
  verb.add_option("--impedance-damping", damping,
                  "with a stiffness: damping of the impedance, 30Nms_rad (default 0)");
  verb.add_option("--torque-gain", torque_gain,
                  "with a stiffness of harmonic-drive: gain K_tp of the inner loop (default "
                  "0.5Nm_rad)");
  verb.add_option("--correction", correction,
                  "with --impedance and a --model that has no inverse: bandwidth in which its "
                  "estimate corrects the torque (default 6rad_s)");
}

void ImpedanceFlags::check(const CLI::App& verb) const {
  const auto is_given = [&](const char* flag) { return verb.get_option(flag)->count() > 0; };
  const bool has_gains_of_paper = impedance == "high" || impedance == "zero";
  for (const char* flag : {"--impedance-damping", "--torque-gain"}) {
    if (!is_given(flag) || (!impedance.empty() && !has_gains_of_paper)) continue;
    throw torsio::UsageError(
        {.place = flag,
         .problem = impedance.empty() ? std::string("no impedance is controlled")
                                      : "the gains of --impedance " + impedance + " are given",
         .expected = "a stiffness, --impedance 2000Nm_rad"});
  }
  if (is_given("--correction") && (impedance.empty() || !is_given("--model")))
    throw torsio::UsageError(
        {.place = "--correction",
         .problem = impedance.empty() ? "no impedance is controlled"
                                      : "there is no estimate that corrects the torque",
         .expected = impedance.empty() ? "a stiffness, --impedance 2000Nm_rad"
                                       : "--model FILE, a model that has no inverse"});
  if (impedance.empty()) return;
  for (const char* flag : {"--joint-output", "--lever", "--reference", "--replay", "--mapping",
                           "--rate", "--friction", "--observer", "--feed-forward", "--limits",
                           "--acts-on", "--velocity-bandwidth", "--faults", "--seeds"})
    if (is_given(flag))
      throw torsio::UsageError(
          {.place = flag,
           .problem = "it belongs to the torque loop, and --impedance replaces this loop",
           .expected = "one of the two loops",
           .advice = "With --impedance: --impedance-damping, --torque-gain, --model, "
                     "--correction, --bandwidth, --damping, --amplitude, --duration, --seed, "
                     "--output, --json, --report."});
}

void run_impedance(const ImpedanceFlags& flags, const SharedTrackFlags& shared) {
  ProgressBar progress;
  const torsio::DataSheet sheet = torsio::find_data_sheet(shared.actuator, progress.listener());
  const torsio::ImpedanceSpec spec = spec_of(flags, shared);
  const std::vector<torsio::ImpedanceModel> models = models_of(shared.models, sheet);
  warn_of_other_springs(models, sheet, spec, progress.listener());
  const std::vector<torsio::ImpedanceRun> runs =
      torsio::track_impedances(sheet, spec, models, shared.seed, progress.listener());
  if (!shared.record.empty()) torsio::write_recording(runs.back().record, shared.record);
  if (shared.json.wants_tables()) print(torsio::impedance_text(runs));
  shared.json.write(torsio::impedance_json(runs));
  if (shared.report.is_wanted()) shared.report.write(torsio::impedance_report(runs));
}
