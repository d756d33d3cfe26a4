#include <memory>
#include <string>

#include "design/design_flags.hpp"
#include "design/outline.hpp"
#include "torsio/core/error.hpp"
#include "torsio/design/clutch.hpp"
#include "torsio/design/rubber_spring.hpp"
#include "torsio/design/tables.hpp"
#include "verbs.hpp"

namespace {

struct RubberFlags {
  torsio::RubberSpringDemand demand;
  std::string torque, angle, stiffness, modulus, stress, strain;
  std::string outer, inner, shortest, longest, wall, grid, tolerance;
  double hardness = 60.0;
  DesignOutputs outputs;
};

void run(const RubberFlags& flags) {
  flags.outputs.check();
  require_options("design rubber-spring",
                  {{"--torque", &flags.torque, "0.5Nm"},
                   {"--angle", &flags.angle, "15deg", "--stiffness", &flags.stiffness}});
  torsio::RubberSpringDemand demand = flags.demand;
  demand.torque_Nm = needed(flags.torque, "Nm", "--torque");
  demand.angle_rad = flags.angle.empty()
                         ? demand.torque_Nm / needed(flags.stiffness, "Nm_rad", "--stiffness")
                         : needed(flags.angle, "rad", "--angle");
  demand.shear_modulus_Pa = flags.modulus.empty()
                                ? torsio::shear_modulus_of_hardness(flags.hardness)
                                : needed(flags.modulus, "Pa", "--shear-modulus");
  if (!flags.strain.empty())
    require_options("design rubber-spring",
                    {{"--strain", &flags.strain, "70pct", "--stress", &flags.stress}});
  demand.allowed_stress_Pa = quantity(flags.stress, "Pa", "--stress", demand.allowed_stress_Pa);
  if (!flags.strain.empty())
    demand.allowed_stress_Pa =
        demand.correction * demand.shear_modulus_Pa * needed(flags.strain, "1", "--strain");
  demand.largest_outer_m = quantity(flags.outer, "m", "--max-radius", demand.largest_outer_m);
  demand.least_inner_m = quantity(flags.inner, "m", "--bore-radius", demand.least_inner_m);
  demand.least_length_m = quantity(flags.shortest, "m", "--min-length", demand.least_length_m);
  demand.largest_length_m = quantity(flags.longest, "m", "--max-length", demand.largest_length_m);
  demand.least_wall_m = quantity(flags.wall, "m", "--wall", demand.least_wall_m);
  demand.grid_m = quantity(flags.grid, "m", "--grid", demand.grid_m);
  demand.dimension_tolerance_m =
      quantity(flags.tolerance, "m", "--tolerance", demand.dimension_tolerance_m);
  const torsio::DesignReport report = torsio::rubber_spring_report(demand);
  flags.outputs.write(report);
  if (flags.outputs.dxf.empty()) return;
  const auto rounded = [&](const char* name) { return 1e-3 * report.at("rounded", name).value; };
  write_text(flags.outputs.dxf, torsio::dxf_of_ring({rounded("outer_radius"),
                                                     rounded("inner_radius"), rounded("length")}));
}

void add_rubber_spring(CLI::App& design) {
  auto flags = std::make_shared<RubberFlags>();
  CLI::App* verb = design.add_subcommand(
      "rubber-spring",
      "a ring of rubber bonded on both ends: radii and length of the least volume");
  verb->footer(
      "Example: torsio design rubber-spring --torque 0.5Nm --angle 15deg --hardness 60\n"
      "The defaults of bounds, stress and weights are those of paper 002.");
  verb->add_option("--torque", flags->torque, "largest torque, 0.5Nm");
  verb->add_option("--angle", flags->angle, "deflection under it, 15deg");
  verb->add_option("--stiffness", flags->stiffness, "in place of the angle, 1.9Nm/rad");
  verb->add_option("--hardness", flags->hardness, "Shore A, 30 to 80")->capture_default_str();
  verb->add_option("--shear-modulus", flags->modulus, "in place of the hardness, 0.9MPa");
  verb->add_option("--correction", flags->demand.correction,
                   "measured stiffness over the formula's")
      ->capture_default_str();
  verb->add_option("--stress", flags->stress, "allowed shear stress; 0.7MPa if not given");
  verb->add_option("--strain", flags->strain, "allowed shear strain in place of the stress, 70pct");
  verb->add_option("--safety", flags->demand.safety, "safety factor of the stress")
      ->capture_default_str();
  verb->add_option("--max-radius", flags->outer, "largest outer radius; 10mm if not given");
  verb->add_option("--bore-radius", flags->inner, "least inner radius, for a shaft; 0mm");
  verb->add_option("--min-length", flags->shortest, "least length; 4mm if not given");
  verb->add_option("--max-length", flags->longest, "largest length; 10mm if not given");
  verb->add_option("--wall", flags->wall, "least wall; 1mm if not given");
  verb->add_option("--constraint", flags->demand.constraints,
                   "a further one, as 'length <= 0.6 * outer_radius'; may be given more than once")
      ->take_all()
      ->allow_extra_args(false);
  verb->add_option("--volume-weight", flags->demand.weight_volume,
                   "a, on the volume per torque in mm^3/Nm")
      ->capture_default_str();
  verb->add_option("--length-weight", flags->demand.weight_length, "b, on the length in mm")
      ->capture_default_str();
  verb->add_option("--grid", flags->grid, "grid of the rounded dimensions; 0.1mm if not given");
  verb->add_option("--hardness-tolerance", flags->demand.hardness_tolerance, "Shore points")
      ->capture_default_str();
  verb->add_option("--tolerance", flags->tolerance, "of each dimension; 0.05mm if not given");
  flags->outputs.add(*verb, true, "Section");
  verb->callback([flags] { run(*flags); });
}

struct ClutchFlags {
  torsio::ClutchDemand demand;
  std::string slip, torque, outer, inner, table, washer;
  double margin = 1.0;
  DesignOutputs outputs;
};

void run(const ClutchFlags& flags) {
  flags.outputs.check();
  require_options("design clutch", {{"--slip", &flags.slip, "0.5Nm", "--torque", &flags.torque}});
  torsio::ClutchDemand demand = flags.demand;
  demand.slip_Nm = flags.slip.empty() ? flags.margin * needed(flags.torque, "Nm", "--torque")
                                      : needed(flags.slip, "Nm", "--slip");
  demand.outer_m = quantity(flags.outer, "m", "--outer-radius", demand.outer_m);
  demand.inner_m = quantity(flags.inner, "m", "--inner-radius", demand.inner_m);
  const auto washers = torsio::read_washers(flags.table);
  demand.washer = flags.washer.empty() ? washers.front()
                                       : torsio::find_entry(washers, flags.washer, "--washer");
  flags.outputs.write(torsio::design_clutch(demand));
}

void add_clutch(CLI::App& design) {
  auto flags = std::make_shared<ClutchFlags>();
  CLI::App* verb = design.add_subcommand(
      "clutch",
      "a friction clutch and its Belleville washers: force, travel, spread of the torque");
  verb->footer("Example: torsio design clutch --slip 0.5Nm --series 2");
  verb->add_option("--slip", flags->slip, "torque at which it slips, 0.5Nm");
  verb->add_option("--torque", flags->torque, "in its place, the largest torque to be carried");
  verb->add_option("--margin", flags->margin, "slip torque over that torque")
      ->capture_default_str();
  verb->add_option("--outer-radius", flags->outer, "of the lining; 7.5mm if not given");
  verb->add_option("--inner-radius", flags->inner, "of the lining; 4.5mm if not given");
  verb->add_option("--friction", flags->demand.friction, "coefficient")->capture_default_str();
  verb->add_option("--min-friction", flags->demand.least_friction, "for the spread")
      ->capture_default_str();
  verb->add_option("--max-friction", flags->demand.largest_friction, "for the spread")
      ->capture_default_str();
  verb->add_option("--surfaces", flags->demand.surfaces, "pairs of sliding faces")
      ->capture_default_str();
  verb->add_option("--washers", flags->table, "YAML table; the shipped one if not given");
  verb->add_option("--washer", flags->washer, "its name in the table; the first if not given");
  verb->add_option("--parallel", flags->demand.parallel, "washers on each other")
      ->capture_default_str();
  verb->add_option("--series", flags->demand.series, "such packs against each other")
      ->capture_default_str();
  flags->outputs.add(*verb, false, "Axial force");
  verb->callback([flags] { run(*flags); });
}

}  // namespace

void add_design(CLI::App& app) {
  CLI::App* design = app.add_subcommand(
      "design", "size springs, clutch, coupling and actuator before they are built");
  design->footer(
      "Example: torsio design spring --torque 120Nm --angle 6deg --max-diameter 20mm "
      "--max-length 120mm\n"
      "Every length, torque and stress needs its unit. torsio design VERB --help shows the flags.");
  design->require_subcommand(1);
  add_rubber_spring(*design);
  add_clutch(*design);
  add_design_spring(*design);
  add_design_actuator(*design);
  add_design_coupling(*design);
}
