#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/exciting_program.hpp"
#include "torsio/report/text_table.hpp"

namespace {

struct ExciteFlags {
  std::string arm = kReadyArm;
  std::string goal = "payload";
  std::string tilt;
  std::string height;
  torsio::ExcitationSpec spec = {};
  double range_percent = 85.0;
  std::string output;
  JsonOutput json;
};

std::string excitation_text(const ExciteFlags& flags, const torsio::ArmSetup& setup,
                            const torsio::ExcitingProgram& planned) {
  torsio::TextTable table;
  table.header({"joint", "largest speed [deg/s]", "largest torque [Nm]", "of the rating [%]"});
  for (std::size_t j = 0; j < setup.joints.size(); ++j)
    table.row({setup.arm.joints[j].name,
               fmt::format("{:.0f}", torsio::deg_from_rad(planned.largest_speed_rad_s[j])),
               fmt::format("{:.1f}", planned.largest_torque_Nm[j]),
               fmt::format("{:.0f}", 100.0 * planned.largest_torque_Nm[j] /
                                         setup.joints[j].sheet.rating.torque_Nm.value)});
  std::string text =
      fmt::format("{}: {} moves for the {}, {:.1f} s\n{}", setup.arm.name,
                  planned.program.steps.size(), flags.goal, planned.duration_s, table.text());
  if (std::isfinite(planned.condition_number))
    text += fmt::format("condition number of the regressor: {:.1f}\n", planned.condition_number);
  return text;
}

void excite(ExciteFlags& flags) {
  DataFlags().check_outputs({flags.output, flags.json.destination},
                            {flags.arm == kReadyArm ? std::string() : flags.arm});
  require_ending("-o", flags.output, {".yaml", ".yml"});
  if (flags.goal != "payload" && flags.goal != "links" && flags.goal != "springs")
    throw torsio::UsageError({.place = "--for",
                              .expected = "payload, links or springs",
                              .found = "'" + flags.goal + "'"});
  if (flags.goal == "links") flags.spec.goal = torsio::ExcitationGoal::links;
  if (flags.goal == "springs") flags.spec.goal = torsio::ExcitationGoal::springs;
  flags.spec.range_share = 0.01 * flags.range_percent;
  if (!flags.height.empty())
    flags.spec.lowest_height_m = torsio::signed_quantity_with_unit(flags.height, "m", "--height");
  ProgressBar progress;
  torsio::ArmSetup setup = arm_of(flags.arm, progress.listener());
  if (!flags.tilt.empty())
    setup.arm.gravity_m_s2 =
        torsio::tilted_gravity(torsio::signed_quantity_with_unit(flags.tilt, "rad", "--tilt"));
  const torsio::ExcitingProgram planned =
      torsio::exciting_program(setup, flags.spec, progress.listener());
  write_text(flags.output, torsio::program_yaml(planned.program));
  if (flags.json.wants_tables()) print(excitation_text(flags, setup, planned));
  flags.json.write(torsio::json_text(
      nlohmann::ordered_json{{"arm", flags.arm},
                             {"for", flags.goal},
                             {"seed", flags.spec.seed},
                             {"moves", planned.program.steps.size()},
                             {"duration_s", planned.duration_s},
                             {"condition_number", planned.condition_number},
                             {"information", planned.information},
                             {"largest_torque_Nm", planned.largest_torque_Nm},
                             {"largest_speed_rad_s", planned.largest_speed_rad_s}}));
  remark(fmt::format("{}: for 'torsio arm --program {}'", flags.output, flags.output));
}

}  // namespace

void add_arm_excite(CLI::App& arm) {
  auto flags = std::make_shared<ExciteFlags>();
  CLI::App* verb = arm.add_subcommand(
      "excite", "write a program of moves that determines payload or links well");
  verb->footer(
      "Example: torsio arm excite -o moves.yaml\n"
      "         torsio arm excite my_arm.yaml --for links --moves 40 -o moves.yaml\n"
      "Look at the moves before a real arm makes them: what surrounds it is not considered.");
  verb->add_option("ARM", flags->arm,
                   "arm6, or FILE.yaml of your own with the heaviest payload that it may carry")
      ->capture_default_str();
  verb->add_option("-o,--output", flags->output, "FILE.yaml for the program")->required();
  verb->add_option("--for", flags->goal, "payload, links, or springs (for arm calibrate)")
      ->capture_default_str();
  verb->add_option("--moves", flags->spec.moves, "number of moves")->capture_default_str();
  verb->add_option("--candidates", flags->spec.candidates,
                   "random poses for each move, of which the best one is taken")
      ->capture_default_str();
  verb->add_option("--range", flags->range_percent,
                   "percent of each joint's range about its middle")
      ->capture_default_str();
  verb->add_option("--height", flags->height,
                   "joints and flange stay so far above the base (default: 100mm)");
  verb->add_option("--tilt", flags->tilt,
                   "tilt of the base about its y axis, in place of that of the arm's file: 30deg");
  add_seed(*verb, flags->spec.seed, "seed of the poses");
  flags->json.add(*verb, "the result");
  verb->callback([flags] { excite(*flags); });
}
