#include "control/track_impedance.hpp"

#include <utility>

#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/write.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"

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
  set(spec.torque_gain_Nm_rad, flags.torque_gain, "Nm_rad", "--torque-gain");
  set(spec.amplitude_Nm, shared.amplitude, "Nm", "--amplitude");
  set(spec.duration_s, shared.duration, "s", "--duration");
  return spec;
}

}  // namespace

void ImpedanceFlags::add(CLI::App& verb) {
  verb.add_option("--impedance", impedance,
                  "impedance control of harmonic-drive instead of the torque loop: high or zero "
                  "(gains of paper 004), or a stiffness: 2000Nm_rad");
  verb.add_option("--impedance-damping", damping,
                  "with a stiffness: damping of the impedance, 30Nms_rad (default 0)");
  verb.add_option("--torque-gain", torque_gain,
                  "with a stiffness: gain K_tp of the inner loop (default 0.5Nm_rad)");
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
  if (impedance.empty()) return;
  for (const char* flag :
       {"--output", "--lever", "--reference", "--replay", "--mapping", "--model", "--bandwidth",
        "--rate", "--damping", "--friction", "--observer", "--feed-forward", "--limits",
        "--acts-on", "--velocity-bandwidth", "--faults", "--seeds"})
    if (is_given(flag))
      throw torsio::UsageError(
          {.place = flag,
           .problem = "it belongs to the torque loop, and --impedance replaces this loop",
           .expected = "one of the two loops",
           .advice = "With --impedance: --impedance-damping, --torque-gain, --amplitude, "
                     "--duration, --seed, --record, --json, --report."});
}

void run_impedance(const ImpedanceFlags& flags, const SharedTrackFlags& shared) {
  ProgressBar progress;
  const torsio::DataSheet sheet = torsio::find_data_sheet(shared.actuator, progress.listener());
  const torsio::ImpedanceRun run =
      torsio::track_impedance(sheet, spec_of(flags, shared), shared.seed, progress.listener());
  if (!shared.record.empty()) torsio::write_recording(run.record, shared.record);
  if (shared.json.wants_tables()) print(torsio::impedance_text(run));
  shared.json.write(torsio::impedance_json(run));
  if (shared.report.is_wanted()) shared.report.write(torsio::impedance_report(run));
}
