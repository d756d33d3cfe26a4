#include <filesystem>
#include <memory>
#include <string>

#include "design/design_flags.hpp"
#include "design/outline.hpp"
#include "torsio/core/error.hpp"
#include "torsio/design/spring.hpp"

namespace {

struct SpringFlags {
  std::string kind = "any";
  std::string torque, angle, stiffness, diameter, length, bore;
  std::string table, material = "50CrV4", washers, sheet;
  double safety = 1.0;
  std::string load_inertia = "0.15kgm2";
  double bits = 19.0;
  DesignOutputs outputs;
};

torsio::SpringDemand demand_of(const SpringFlags& flags) {
  require_options("design spring",
                  {{"--torque", &flags.torque, "120Nm"},
                   {"--angle", &flags.angle, "6deg", "--stiffness", &flags.stiffness},
                   {"--max-diameter", &flags.diameter, "60mm"},
                   {"--max-length", &flags.length, "120mm"}});
  torsio::SpringDemand demand;
  demand.torque_Nm = needed(flags.torque, "Nm", "--torque");
  demand.angle_rad = flags.angle.empty()
                         ? demand.torque_Nm / needed(flags.stiffness, "Nm_rad", "--stiffness")
                         : needed(flags.angle, "rad", "--angle");
  demand.largest_diameter_m = needed(flags.diameter, "m", "--max-diameter");
  demand.largest_length_m = needed(flags.length, "m", "--max-length");
  demand.bore_m = quantity(flags.bore, "m", "--bore", 0.0);
  demand.safety = flags.safety;
  demand.load_inertia_kg_m2 = needed(flags.load_inertia, "kg_m2", "--load-inertia");
  demand.encoder_bits = flags.bits;
  demand.material =
      torsio::find_entry(torsio::read_materials(flags.table), flags.material, "--material");
  demand.washers = torsio::read_washers(flags.washers);
  return demand;
}

void run(const SpringFlags& flags) {
  using torsio::SpringKind;
  flags.outputs.check({flags.sheet});
  require_ending("--sheet", flags.sheet, {".yaml", ".yml"});
  const torsio::SpringDemand demand = demand_of(flags);
  const bool is_any = flags.kind == "any";
  const auto wanted = is_any ? SpringKind::rod : torsio::spring_kind(flags.kind);
  const auto kinds = torsio::design_springs(demand);
  const torsio::SpringDesign design =
      is_any ? torsio::lightest_spring(kinds) : kinds.at(static_cast<std::size_t>(wanted));
  const bool is_rod = design.kind == SpringKind::rod || design.kind == SpringKind::tube;
  if (design.is_feasible && !flags.outputs.dxf.empty() && !is_rod)
    throw torsio::UsageError({.place = "--dxf",
                              .expected = "a rod or a tube, whose outline can be written",
                              .found = std::string(torsio::name_of(design.kind))});
  const std::string name = std::filesystem::path(flags.sheet).stem().string();
  const std::string sheet =
      design.is_feasible ? sheet_text(torsio::spring_sheet(demand, design, name), flags.sheet)
                         : std::string();
  flags.outputs.write(torsio::spring_report(demand, design, kinds));
  if (!flags.outputs.dxf.empty())
    write_text(flags.outputs.dxf,
               torsio::dxf_of_rod(design.outer_m, design.inner_m, design.length_m));
  if (!flags.sheet.empty()) write_text(flags.sheet, sheet);
}

}  // namespace

void add_design_spring(CLI::App& design) {
  auto flags = std::make_shared<SpringFlags>();
  CLI::App* verb = design.add_subcommand(
      "spring", "a spring of metal: torsion rod, tube, coil springs, disc springs beside a lever");
  verb->footer(
      "Example: torsio design spring --torque 120Nm --angle 6deg --max-diameter 20mm\n"
      "           --max-length 120mm --bore 10mm --sheet joint.yaml\n"
      "torsio simulate joint.yaml static-cycle -o cycle.csv   then measures it.");
  verb->add_option("--kind", flags->kind,
                   "rod, tube, coils, discs; any: the lightest. The table compares all")
      ->capture_default_str();
  verb->add_option("--torque", flags->torque, "largest torque, 120Nm");
  verb->add_option("--angle", flags->angle, "deflection under it, 6deg");
  verb->add_option("--stiffness", flags->stiffness, "in place of the angle, 19.8Nm/deg");
  verb->add_option("--max-diameter", flags->diameter, "envelope, 60mm");
  verb->add_option("--max-length", flags->length, "envelope along the axis, 100mm");
  verb->add_option("--bore", flags->bore, "diameter that stays free; 0mm if not given");
  verb->add_option("--material", flags->material, "its name in the table")->capture_default_str();
  verb->add_option("--materials", flags->table, "YAML table; the shipped one if not given");
  verb->add_option("--washers", flags->washers,
                   "YAML table of discs; the shipped one if not given");
  verb->add_option("--safety", flags->safety, "safety factor of the stress")->capture_default_str();
  verb->add_option("--load-inertia", flags->load_inertia, "of the link")->capture_default_str();
  verb->add_option("--encoder-bits", flags->bits, "of the encoders around the spring")
      ->capture_default_str();
  verb->add_option("--sheet", flags->sheet, "write a data sheet for torsio simulate, FILE.yaml");
  flags->outputs.add(*verb, true, "Torque over");
  verb->callback([flags] { run(*flags); });
}
