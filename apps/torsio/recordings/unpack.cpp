#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/recording_blocks.hpp"
#include "torsio/data/write.hpp"
#include "verbs.hpp"

namespace {

struct UnpackFlags {
  std::string recording;
  std::string output;
  JsonOutput json;
};

std::size_t missing_frames(const torsio::RecordingBlocks& blocks) {
  return blocks.recording.size() - blocks.frames;
}

std::string text_of(const torsio::RecordingBlocks& blocks, const UnpackFlags& flags) {
  const torsio::Recording& recording = blocks.recording;
  std::string text = fmt::format("{}: {} frames of {} channels at {:g} Hz in {} blocks",
                                 flags.output, blocks.frames, recording.channels().size(),
                                 recording.sample_rate_Hz(), blocks.blocks);
  if (missing_frames(blocks) > 0)
    text += fmt::format("\n{} ticks have no frame and are nan ({} frames were dropped)",
                        missing_frames(blocks), blocks.dropped);
  if (!blocks.was_closed)
    text += "\nthe recorder was not closed: frames that were not sealed are lost";
  if (blocks.torn_bytes > 0)
    text += fmt::format("\n{} bytes after the last sealed block were ignored", blocks.torn_bytes);
  return text;
}

std::string json_of(const torsio::RecordingBlocks& blocks) {
  return torsio::json_text(
      nlohmann::ordered_json{{"frames", blocks.frames},
                             {"blocks", blocks.blocks},
                             {"missing", missing_frames(blocks)},
                             {"dropped", blocks.dropped},
                             {"torn_bytes", blocks.torn_bytes},
                             {"was_closed", blocks.was_closed},
                             {"sample_rate_Hz", blocks.recording.sample_rate_Hz()}});
}

void run(const UnpackFlags& flags) {
  DataFlags().check_outputs({flags.output, flags.json.destination}, {flags.recording});
  const torsio::RecordingBlocks blocks = torsio::read_recording_blocks(flags.recording);
  if (blocks.frames == 0)
    throw torsio::Error({.place = flags.recording, .problem = "no block with frames was sealed"});
  ProgressBar progress;
  torsio::write_recording(blocks.recording, flags.output, progress.listener());
  remark(text_of(blocks, flags));
  flags.json.write(json_of(blocks));
}

}  // namespace

void add_unpack(CLI::App& app) {
  auto flags = std::make_shared<UnpackFlags>();
  CLI::App* verb =
      app.add_subcommand("unpack", "convert a recorder's file (.tsr) to CSV, MCAP, .npz or .mat");
  verb->footer("Example: torsio unpack run.tsr -o run.csv.gz");
  verb->add_option("recording", flags->recording, "file of a torsio::Recorder")->required();
  verb->add_option(
          "-o,--output", flags->output,
          fmt::format("file to write; its ending names the format: {}", torsio::kRecordingEndings))
      ->required();
  flags->json.add(*verb, "the contents of the file");
  verb->callback([flags] { run(*flags); });
}
