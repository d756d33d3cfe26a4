#include <filesystem>
#include <memory>
#include <string>

#include "common/data_flags.hpp"
#include "design/design_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/design/actuator.hpp"

namespace {

struct ActuatorFlags {
  torsio::ActuatorDemand demand;
  std::string continuous, peak, speed, deflection, bandwidth = "8Hz", impedance, softest;
  std::string collision, reach, link_inertia = "0.15kgm2";
  std::string diameter = "100mm", length = "120mm", bore, resolution;
  std::string drives, materials, washers, material = "50CrV4", sheet;
  DesignOutputs outputs;
};

torsio::ActuatorDemand demand_of(const ActuatorFlags& flags) {
  require_options("design actuator", {{"--continuous", &flags.continuous, "40Nm"},
                                      {"--peak", &flags.peak, "80Nm"},
                                      {"--speed", &flags.speed, "60deg/s"},
                                      {"--deflection", &flags.deflection, "5deg"}});
  torsio::ActuatorDemand demand = flags.demand;
  demand.continuous_Nm = needed(flags.continuous, "Nm", "--continuous");
  demand.peak_Nm = needed(flags.peak, "Nm", "--peak");
  demand.speed_rad_s = needed(flags.speed, "rad_s", "--speed");
  demand.deflection_rad = needed(flags.deflection, "rad", "--deflection");
  demand.bandwidth_rad_s = angular_frequency_rad_s(flags.bandwidth, "--bandwidth");
  demand.impedance_Nm_rad = quantity(flags.impedance, "Nm_rad", "--impedance", 0.0);
  demand.softest_Nm_rad =
      quantity(flags.softest, "Nm_rad", "--softest-impedance", demand.softest_Nm_rad);
  demand.collision_N = quantity(flags.collision, "N", "--collision", demand.collision_N);
  demand.link_inertia_kg_m2 = needed(flags.link_inertia, "kg_m2", "--link-inertia");
  demand.reach_m = quantity(flags.reach, "m", "--reach", demand.reach_m);
  demand.torque_resolution_Nm =
      quantity(flags.resolution, "Nm", "--resolution", demand.torque_resolution_Nm);
  demand.envelope.largest_diameter_m = needed(flags.diameter, "m", "--max-diameter");
  demand.envelope.largest_length_m = needed(flags.length, "m", "--max-length");
  demand.envelope.bore_m = quantity(flags.bore, "m", "--bore", 0.0);
  demand.envelope.material =
      torsio::find_entry(torsio::read_materials(flags.materials), flags.material, "--material");
  demand.envelope.washers = torsio::read_washers(flags.washers);
  return demand;
}

void run(const ActuatorFlags& flags) {
  flags.outputs.check({flags.sheet});
  require_ending("--sheet", flags.sheet, {".yaml", ".yml"});
  const torsio::ActuatorDemand demand = demand_of(flags);
  const std::string name = flags.sheet.empty() ? std::string("designed")
                                               : std::filesystem::path(flags.sheet).stem().string();
  const torsio::ActuatorDesign design =
      torsio::design_actuator(demand, torsio::read_drives(flags.drives), name);
  const std::string sheet = design.is_feasible
                                ? sheet_text(design.candidates[design.chosen].sheet, flags.sheet)
                                : std::string();
  flags.outputs.write(torsio::actuator_report(demand, design));
  if (!flags.sheet.empty()) write_text(flags.sheet, sheet);
}

}  // namespace

void add_design_actuator(CLI::App& design) {
  auto flags = std::make_shared<ActuatorFlags>();
  CLI::App* verb = design.add_subcommand(
      "actuator", "gear, motor and spring for the demands of a joint, from tables");
  verb->footer(
      "Example: torsio design actuator --continuous 40Nm --peak 80Nm --speed 60deg/s\n"
      "           --deflection 5deg --sheet joint.yaml --plot pareto.svg\n"
      "torsio tune-loop --actuator joint.yaml, track --actuator joint.yaml and simulate "
      "joint.yaml\n"
      "then drive it.");
  verb->add_option("--continuous", flags->continuous, "torque for any length of time, 40Nm");
  verb->add_option("--peak", flags->peak, "torque for a moment, 80Nm");
  verb->add_option("--speed", flags->speed, "under the continuous torque, 60deg/s");
  verb->add_option("--deflection", flags->deflection, "of the spring under the peak torque, 5deg");
  verb->add_option("--bandwidth", flags->bandwidth, "-3 dB of the torque loop, in Hz or rad_s")
      ->capture_default_str();
  verb->add_option("--impedance", flags->impedance,
                   "stiffest impedance that must be passive up to 1 Hz, 300Nm/rad");
  verb->add_option("--softest-impedance", flags->softest,
                   "softest impedance that must be rendered at 1 Hz, 20Nm/rad");
  verb->add_option("--collision", flags->collision, "largest force at the link's tip, 150N");
  verb->add_option("--reach", flags->reach, "length of the link; 0.5m if not given");
  verb->add_option("--link-inertia", flags->link_inertia, "moment of inertia of the link")
      ->capture_default_str();
  verb->add_option("--resolution", flags->resolution, "of the torque by the spring, 0.05Nm");
  verb->add_option("--encoder-bits", flags->demand.envelope.encoder_bits, "around the spring")
      ->capture_default_str();
  verb->add_option("--max-diameter", flags->diameter, "envelope of the spring")
      ->capture_default_str();
  verb->add_option("--max-length", flags->length, "envelope of the spring")->capture_default_str();
  verb->add_option("--bore", flags->bore, "diameter that stays free; 0mm if not given");
  verb->add_option("--safety", flags->demand.envelope.safety, "safety factor of the spring")
      ->capture_default_str();
  verb->add_option("--drives", flags->drives, "YAML table; the shipped one if not given");
  verb->add_option("--materials", flags->materials, "YAML table; the shipped one if not given");
  verb->add_option("--material", flags->material, "its name in the table")->capture_default_str();
  verb->add_option("--washers", flags->washers, "YAML table; the shipped one if not given");
  verb->add_option("--sheet", flags->sheet, "write a data sheet for simulate, track and tune-loop");
  flags->outputs.add(*verb, false, "Drives");
  verb->callback([flags] { run(*flags); });
}
