#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "report/json_text.hpp"
#include "report/log_summary.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/recording_blocks.hpp"
#include "torsio/data/write.hpp"
#include "verbs.hpp"

namespace {

struct ConvertFlags {
  DataFlags data;
  std::string input;
  std::string output;
  JsonOutput json;
};

bool is_recorder_file(const std::string& path) { return path.ends_with(".tsr"); }

torsio::Recording read(const ConvertFlags& flags, const torsio::Progress& progress) {
  if (is_recorder_file(flags.input)) return torsio::read_recording_blocks(flags.input).recording;
  std::vector<torsio::Recording> recordings =
      torsio::load_recordings(flags.input, flags.data.load_options(progress));
  const std::vector<const torsio::Recording*> first{&recordings.front()};
  DataFlags::remark_on_reading(first);
  if (recordings.size() == 1) return std::move(recordings.front());
  throw torsio::Error({.place = flags.input,
                       .expected = "one recording",
                       .found = fmt::format("{}, the first of which is {}", recordings.size(),
                                            recordings.front().name()),
                       .advice = "Select one with keep: in the mapping."});
}

void run(ConvertFlags& flags) {
  flags.data.check_outputs({flags.output, flags.json.destination}, {flags.input});
  require_ending("--output", flags.output, {".csv", ".gz", ".mcap", ".npz", ".mat"});
  if (is_recorder_file(flags.input) && !(flags.data.mapping + flags.data.rate).empty())
    throw torsio::UsageError({.place = flags.input,
                              .problem = "a recorder's file has its names and its rate",
                              .advice = "Leave --mapping and --rate out."});
  ProgressBar progress;
  const torsio::Recording recording = read(flags, progress.listener());
  torsio::write_recording(recording, flags.output, progress.listener());
  remark(fmt::format("{}: {} samples of {} channels at {:g} Hz", flags.output, recording.size(),
                     recording.channels().size(), recording.sample_rate_Hz()));
  if (!recording.labels.empty())
    remark(torsio::labels_text(recording) + "; " + flags.output + " does not keep them");
  nlohmann::ordered_json channels = nlohmann::ordered_json::array();
  for (const torsio::Channel& channel : recording.channels()) channels.push_back(channel.name);
  nlohmann::ordered_json document{{"samples", recording.size()},
                                  {"channels", channels},
                                  {"sample_rate_Hz", recording.sample_rate_Hz()}};
  for (const auto& [label, value] : recording.labels) document["labels"][label] = value;
  flags.json.write(torsio::json_text(document));
}

}  // namespace

void add_convert(CLI::App& app) {
  auto flags = std::make_shared<ConvertFlags>();
  CLI::App* verb = app.add_subcommand("convert", "write a recording in another format, in SI");
  verb->footer(
      "Example: torsio convert bag/ --mapping ros2_control_joint --joint elbow -o elbow.csv\n"
      "         torsio convert sweep.csv.gz -o sweep.mcap");
  verb->add_option("recording", flags->input,
                   "CSV, MCAP, rosbag2, ROS 1 bag, .npz, .mat or a recorder's file (.tsr)")
      ->required();
  flags->data.add_mapping(*verb);
  verb->add_option(
          "-o,--output", flags->output,
          fmt::format("file to write; its ending names the format: {}", torsio::kRecordingEndings))
      ->required();
  flags->json.add(*verb, "the contents of the file");
  verb->callback([flags] { run(*flags); });
}
