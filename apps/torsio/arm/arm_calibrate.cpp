#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/write.hpp"
#include "torsio/identify/calibrate_joints.hpp"
#include "torsio/report/text_table.hpp"

namespace {

struct ArmCalibrateFlags {
  std::vector<std::string> motions;
  std::string folder;
  double weight_within_percent = 0.1;
  double links_within_percent = 1.0;
  std::string links_com;
  std::string attachment;
  JsonOutput json;
};

/// RECORDING=ARM.yaml
struct MotionFlag {
  std::string recording;
  std::string arm;
};

MotionFlag motion_of(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
    throw torsio::UsageError(
        {.place = "torsio arm calibrate",
         .expected = "RECORDING=ARM.yaml, the file of the arm with the weight and the tilt of the "
                     "recording",
         .found = "'" + text + "'",
         .advice = "For example front_0.csv=front_0.yaml"});
  return {.recording = text.substr(0, equals), .arm = text.substr(equals + 1)};
}

std::vector<torsio::CalibrationMotion> calibration_motions(const std::vector<MotionFlag>& flags,
                                                           const torsio::Progress& progress) {
  std::vector<torsio::CalibrationMotion> motions;
  for (const MotionFlag& flag : flags) {
    torsio::LoadOptions options;
    options.progress = progress;
    const torsio::ArmSetup setup = arm_of(flag.arm, progress);
    for (torsio::Recording& recording : torsio::load_recordings(flag.recording, options))
      motions.push_back({.setup = setup, .recording = std::move(recording)});
  }
  return motions;
}

std::string calibrated_text(const std::vector<torsio::CalibratedJoint>& joints) {
  torsio::TextTable table;
  table.header({"joint", "actuator", "of the weight [Nm]", "of the rating [%]", "largest [Nm]",
                "+- weight [Nm]", "+- links [Nm]", "+- target [Nm]", "not determined, since"});
  for (const torsio::CalibratedJoint& joint : joints)
    table.row({joint.name, joint.actuator, fmt::format("{:.2f}", joint.largest_weight_Nm),
               fmt::format("{:.0f}", 100.0 * joint.weight_share()),
               fmt::format("{:.2f}", joint.largest_Nm), fmt::format("{:.3f}", joint.weight_std_Nm),
               fmt::format("{:.3f}", joint.links_std_Nm),
               fmt::format("{:.3f}", joint.target_std_Nm), joint.reason});
  return table.text() +
         "of the weight: the largest torque of the known weight; +-: one standard deviation of the "
         "target (RMS), from the weight with its attachment and from the links\n";
}

nlohmann::ordered_json calibrated_json(const std::vector<torsio::CalibratedJoint>& joints) {
  auto rows = nlohmann::ordered_json::array();
  for (const torsio::CalibratedJoint& joint : joints)
    rows.push_back({{"joint", joint.name},
                    {"actuator", joint.actuator},
                    {"is_determined", joint.is_determined},
                    {"reason", joint.reason},
                    {"largest_weight_Nm", joint.largest_weight_Nm},
                    {"largest_Nm", joint.largest_Nm},
                    {"rating_Nm", joint.rating_Nm},
                    {"weight_std_Nm", joint.weight_std_Nm},
                    {"links_std_Nm", joint.links_std_Nm},
                    {"target_std_Nm", joint.target_std_Nm}});
  return {{"joints", std::move(rows)}};
}

void write_calibrated(const std::string& folder, const std::vector<torsio::CalibratedJoint>& joints,
                      const torsio::Progress& progress) {
  make_folder(folder);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (!joints[j].is_determined) continue;
    for (std::size_t m = 0; m < joints[j].recordings.size(); ++m)
      torsio::write_recording(
          joints[j].recordings[m],
          (std::filesystem::path(folder) / fmt::format("joint{}_{}.csv", j + 1, m + 1)).string(),
          progress);
    remark(fmt::format("{0}: joint{1}_1.csv to joint{1}_{2}.csv, for torsio fit", folder, j + 1,
                       joints[j].recordings.size()));
  }
}

void calibrate_arm(ArmCalibrateFlags& flags) {
  std::vector<MotionFlag> given;
  DataFlags data;
  std::vector<std::string> arms;
  for (const std::string& text : flags.motions) {
    given.push_back(motion_of(text));
    data.recordings.push_back(given.back().recording);
    if (given.back().arm != kReadyArm) arms.push_back(given.back().arm);
  }
  data.check_outputs({flags.json.destination}, arms);
  torsio::CalibrationOptions options{.weight_share = 0.01 * flags.weight_within_percent,
                                     .link_share = 0.01 * flags.links_within_percent};
  if (!flags.links_com.empty())
    options.link_com_m = torsio::signed_quantity_with_unit(flags.links_com, "m", "--links-com");
  if (!flags.attachment.empty())
    options.attachment_m = torsio::signed_quantity_with_unit(flags.attachment, "m", "--attachment");
  ProgressBar progress;
  const std::vector<torsio::CalibratedJoint> joints =
      torsio::calibrate_joints(calibration_motions(given, progress.listener()), options);
  write_calibrated(flags.folder, joints, progress.listener());
  if (flags.json.wants_tables()) print(calibrated_text(joints));
  flags.json.write(torsio::json_text(calibrated_json(joints)));
}

}  // namespace

void add_arm_calibrate(CLI::App& arm) {
  auto flags = std::make_shared<ArmCalibrateFlags>();
  CLI::App* verb = arm.add_subcommand(
      "calibrate",
      "training data of each joint from recordings with a known weight, without a load cell");
  verb->footer(
      "Example: torsio arm calibrate front_0.csv=front_0.yaml side_30.csv=side_30.yaml -o joints/\n"
      "         torsio fit joints/joint2_*.csv --model grey_box -o joint2.safetensors\n"
      "Each file of the arm has the weight as its payload and the tilt of its base: two "
      "attachments, one off the axis of the last joint, and two tilts load all joints but the "
      "first of "
      "arm6. docs/robot/arm_identification.md has the method.");
  verb->add_option(
          "RECORDING=ARM", flags->motions,
          "recordings of 'torsio arm -o', each with the file of the arm as it was recorded")
      ->required();
  verb->add_option("-o,--output", flags->folder,
                   "folder for the recordings of the joints that are determined")
      ->required();
  verb->add_option("--weight-within", flags->weight_within_percent,
                   "percent by which the weight may differ from that of the arm's file")
      ->capture_default_str();
  verb->add_option("--attachment", flags->attachment,
                   "distance by which each coordinate of its centre may differ (default: 0.5mm)");
  verb->add_option("--links-within", flags->links_within_percent,
                   "percent by which mass and inertia of each link may differ from the URDF file")
      ->capture_default_str();
  verb->add_option("--links-com", flags->links_com,
                   "distance by which the centre of mass of each link may differ (default: 2mm)");
  flags->json.add(*verb, "the result");
  verb->callback([flags] { calibrate_arm(*flags); });
}
