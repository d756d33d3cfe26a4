#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/progress_bar.hpp"
#include "design/design_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/coupling/coupling.hpp"
#include "torsio/design/coupling/coupling_search.hpp"

namespace {

struct CouplingFlags {
  torsio::design::CouplingDemand demand;
  std::string angle, length, modulus, torque, strain, metric = "0.8mm";
  std::string half_width, root, flank, taper, slot, ring;
  std::string mesh = "medium";
  std::string time_limit = "120s";
  std::string sheet, resume;
  std::size_t shapes = 0;
  std::uint64_t seed = 1;
  DesignOutputs outputs;
};

constexpr double kMillimetres = 1e3;

std::size_t mesh_level(const std::string& name) {
  if (name == "fine") return 0;
  if (name == "medium") return 1;
  if (name == "coarse") return 2;
  throw torsio::UsageError(
      {.place = "--mesh", .expected = "fine, medium or coarse", .found = name});
}

/// A quantity that may be below 0, unlike `quantity`.
double signed_quantity(const std::string& text, const char* unit, const char* flag, double none) {
  if (!text.starts_with('-')) return text.empty() ? none : quantity(text, unit, flag, none);
  return -needed(text.substr(1), unit, flag);
}

torsio::design::CouplingDemand demand_of(const CouplingFlags& flags) {
  torsio::design::CouplingDemand demand = flags.demand;
  torsio::design::LobeShape& shape = demand.shape;
  shape = torsio::design::paper_lobe(demand.geometry);
  const auto length_mm = [](const std::string& text, const char* flag, double none_mm) {
    return kMillimetres * quantity(text, "m", flag, none_mm / kMillimetres);
  };
  shape.half_width_mm = length_mm(flags.half_width, "--half-width", shape.half_width_mm);
  shape.root_radius_mm = length_mm(flags.root, "--root-radius", shape.root_radius_mm);
  shape.flank_radius_mm = kMillimetres * signed_quantity(flags.flank, "m", "--flank-radius",
                                                         shape.flank_radius_mm / kMillimetres);
  shape.taper_mm = length_mm(flags.taper, "--taper", shape.taper_mm);
  shape.ring_radius_mm = length_mm(flags.ring, "--ring-radius", shape.ring_radius_mm);
  if (!flags.slot.empty())
    shape.slot_angle_deg =
        torsio::deg_from_rad(signed_quantity(flags.slot, "rad", "--slot-angle", 0.0));
  demand.angle_deg = torsio::deg_from_rad(needed(flags.angle, "rad", "--angle"));
  demand.length_mm = length_mm(flags.length, "--length", demand.length_mm);
  demand.finest_mesh = mesh_level(flags.mesh);
  demand.limits.time_s = needed(flags.time_limit, "s", "--time-limit");
  return demand;
}

/// The limit of the strain if one is given.
std::optional<torsio::design::CouplingLimit> limit_of(const CouplingFlags& flags) {
  const auto metric = torsio::design::strain_metric(flags.metric);
  if (flags.strain.empty()) return std::nullopt;
  const double strain = needed(flags.strain, "1", "--strain-limit");
  if (!(strain > 0.0 && strain <= 3.0))
    throw torsio::UsageError({.place = "--strain-limit",
                              .expected = "above 0 to 300 %",
                              .found = fmt::format("{:.6g} %", 100.0 * strain)});
  return torsio::design::CouplingLimit{strain, metric};
}

double positive(double value, const char* flag) {
  if (!(value > 0.0))
    throw torsio::UsageError(
        {.place = flag, .expected = "above 0", .found = fmt::format("{:.6g}", value)});
  return value;
}

double shear_modulus_MPa(const CouplingFlags& flags) {
  return 1e-6 * positive(needed(flags.modulus, "Pa", "--shear-modulus"), "--shear-modulus");
}

/// `--search`: a shape that carries more than the seven.
void search(const CouplingFlags& flags) {
  for (const auto& [flag, value] :
       {std::pair{"--angle", &flags.angle}, std::pair{"--measured-torque", &flags.torque},
        std::pair{"--half-width", &flags.half_width}, std::pair{"--root-radius", &flags.root},
        std::pair{"--flank-radius", &flags.flank}, std::pair{"--slot-angle", &flags.slot},
        std::pair{"--taper", &flags.taper}, std::pair{"--ring-radius", &flags.ring},
        std::pair{"--sheet", &flags.sheet}})
    if (!value->empty())
      throw torsio::UsageError(
          {.place = flag,
           .expected = "a call without --search",
           .found = *value,
           .advice = "Give the dimensions of the best shape to a second call."});
  torsio::design::CouplingSearchSettings settings{
      .demand = flags.demand, .shapes = flags.shapes, .seed = flags.seed, .resume = flags.resume};
  require_options("design coupling --search", {{"--shear-modulus", &flags.modulus, "4MPa"}});
  settings.shear_modulus_MPa = shear_modulus_MPa(flags);
  settings.demand.limits.time_s = needed(flags.time_limit, "s", "--time-limit");
  settings.demand.length_mm = kMillimetres * quantity(flags.length, "m", "--length",
                                                      settings.demand.length_mm / kMillimetres);
  if (const auto limit = limit_of(flags)) settings.limit = *limit;
  settings.limit.metric = torsio::design::strain_metric(flags.metric);
  ProgressBar progress;
  const auto found = torsio::design::search_couplings(settings, progress.listener());
  flags.outputs.write(torsio::design::coupling_search_report(settings, found));
}

void run(const CouplingFlags& flags) {
  using namespace torsio::design;
  flags.outputs.check({flags.sheet});
  require_ending("--sheet", flags.sheet, {".yaml", ".yml"});
  if (flags.shapes > 0) return search(flags);
  require_options("design coupling", {{"--angle", &flags.angle, "6deg"},
                                      {"--measured-torque", &flags.torque, "13.6Nm",
                                       "--shear-modulus", &flags.modulus}});
  const CouplingDemand demand = demand_of(flags);
  const auto limit = limit_of(flags);
  double modulus_MPa = 0.0;
  double measured_Nm = 0.0;
  if (flags.torque.empty())
    modulus_MPa = shear_modulus_MPa(flags);
  else
    measured_Nm = positive(needed(flags.torque, "Nm", "--measured-torque"), "--measured-torque");
  ProgressBar progress;
  const CouplingTwist twist = twist_coupling(demand, progress.listener());
  const auto unit_curve = torque_curve(twist, demand.length_mm, 1.0);
  if (unit_curve.size() < 2)
    throw torsio::Error({.place = "design coupling",
                         .problem = "no twist converged: " + twist.compressed.curve.stopped_by +
                                    twist.stretched.curve.stopped_by});
  std::string calibration = "given";
  if (!flags.torque.empty()) {
    const auto unit_Nm = torque_at(unit_curve, demand.angle_deg);
    if (!unit_Nm)
      throw torsio::Error(
          {.place = "--measured-torque",
           .problem = fmt::format("the angle of {:.4g} deg is not reached; the last twist that "
                                  "converged is {:.4g} deg",
                                  demand.angle_deg, unit_curve.back().first),
           .advice = "use a point at a smaller angle, or --mesh coarse"});
    modulus_MPa = measured_Nm / *unit_Nm;
    calibration =
        fmt::format("calibrated on {:.6g} Nm at {:.4g} deg", measured_Nm, demand.angle_deg);
  }
  const auto report = coupling_report(demand, twist, modulus_MPa, calibration, limit);
  const auto curve = torque_curve(twist, demand.length_mm, modulus_MPa);
  const std::string name = std::filesystem::path(flags.sheet).stem().string();
  const std::string sheet = flags.sheet.empty() || !report.is_feasible
                                ? std::string()
                                : sheet_text(coupling_sheet(curve, name), flags.sheet);
  flags.outputs.write(report);
  if (!flags.sheet.empty()) write_text(flags.sheet, sheet);
}

}  // namespace

void add_design_coupling(CLI::App& design) {
  auto flags = std::make_shared<CouplingFlags>();
  CLI::App* verb = design.add_subcommand(
      "coupling", "a jaw coupling with bonded lobes of rubber, by finite elements (CalculiX)");
  verb->footer(
      "Example: torsio design coupling --geometry delta --angle 6deg --measured-torque 13.6Nm\n"
      "           --sheet coupling.yaml --plot coupling.svg\n"
      "Example: torsio design coupling --search 60 --shear-modulus 4MPa --strain-limit 60pct\n"
      "           --resume shapes.jsonl --report search.html\n"
      "Needs CalculiX: apt-get install calculix-ccx. Torques of both directions are equal.");
  verb->add_option("--geometry", flags->demand.geometry,
                   "alpha, beta, gamma, delta, epsilon, zeta or eta of paper 003")
      ->capture_default_str();
  verb->add_option("--angle", flags->angle, "largest twist, 6deg");
  verb->add_option("--shear-modulus", flags->modulus,
                   "of the rubber, 4MPa; its hardness gives it only within a factor of 4 to 5");
  verb->add_option("--measured-torque", flags->torque,
                   "in its place, the torque measured at --angle, 13.6Nm");
  verb->add_option("--bulk-ratio", flags->demand.bulk_ratio, "bulk over shear modulus")
      ->capture_default_str();
  verb->add_option("--length", flags->length, "along the axis; 10mm if not given");
  verb->add_option("--half-width", flags->half_width, "of the slot, in place of the geometry's");
  verb->add_option("--root-radius", flags->root, "of the jaw's tip, likewise");
  verb->add_option("--flank-radius", flags->flank, "likewise; below 0: convex jaw");
  verb->add_option("--slot-angle", flags->slot, "between the flanks of a slot, likewise");
  verb->add_option("--taper", flags->taper, "recess of the outer face, likewise");
  verb->add_option("--ring-radius", flags->ring,
                   "inner radius of a ring of rubber that joins the lobes; no ring if not given");
  verb->add_option("--strain-limit", flags->strain, "find the twist of this strain, 60pct");
  verb->add_option("--strain-metric", flags->metric,
                   "distance from the ends of a bond within which strains are left out: 0.8mm, "
                   "0.3mm; all: none are")
      ->capture_default_str();
  verb->add_option("--mesh", flags->mesh,
                   "fine, medium or coarse; a coarser one follows where it does not converge")
      ->capture_default_str();
  verb->add_option(
          "--layers", flags->demand.layers,
          "layers of elements along half of the length; 0: plane strain, to compare shapes")
      ->capture_default_str();
  verb->add_option("--jobs", flags->demand.jobs, "solvers at the same time, 1 or 2")
      ->capture_default_str();
  verb->add_option("--time-limit", flags->time_limit, "of one run of the solver")
      ->capture_default_str();
  verb->add_option("--sheet", flags->sheet, "write a data sheet for torsio simulate, FILE.yaml");
  verb->add_option(
          "--search", flags->shapes,
          "look for a shape with more torque and twist at the strain limit than the seven, "
          "with so many trials")
      ->check(CLI::Range(1, 10000));
  verb->add_option("--seed", flags->seed, "of the search")->capture_default_str();
  verb->add_option("--resume", flags->resume,
                   "of the search: file that keeps each result, so that a search that was stopped "
                   "continues");
  flags->outputs.add(*verb, false, "compressed");
  verb->callback([flags] { run(*flags); });
}
