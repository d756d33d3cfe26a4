#include "studies/board_sets.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/did_you_mean.hpp"
#include "data/byte_source.hpp"
#include "paper_figures.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array kSources{
    BoardSource{.folder = "boucwen",
                .title = "Bouc-Wen benchmark, simulated by its authors (Noel and Schoukens 2016)",
                .address =
                    "https://github.com/forgi86/dynonet, commit 56699401, examples/BW/data/Test "
                    "signals/{test,train}.h5; described at https://www.nonlinearbenchmark.org",
                .licence = "MIT for the repository; that of the data was not verified",
                .may_be_redistributed = false,
                .columns = "u_N, y_m at 750 Hz, nine significant digits; CSV instead of HDF5"},
    BoardSource{.folder = "emps",
                .title = "EMPS, a carriage on a screw, measured (Janot, Gautier and Brunot 2019)",
                .address = "https://github.com/helonayala/narmax, commit f663adb3, "
                           "data/EMPS_est.csv and data/EMPS_val.csv; described at "
                           "https://www.nonlinearbenchmark.org",
                .licence = "GPL-3 for the repository; that of the data was not verified",
                .may_be_redistributed = false,
                .columns = "t_s, vir_V, qm_m at 1 kHz; the motor's force is 35.15 N for each volt"},
    BoardSource{
        .folder = "desr_foot",
        .title = "DESR prosthetic ankle with a leaf spring and a switching cam on a dynamometer, "
                 "measured (Quraishi et al., University of Michigan)",
        .address = "https://github.com/UofMNeurobioncs/Decoupled-Energy-Storage-and-Release-Foot, "
                   "commit aad5f239, Data plotting/DESR_Characterization_Data.mat",
        .licence = "MIT",
        .may_be_redistributed = true,
        .columns = "t_s, angle_rad, torque_Nm at 833.3 Hz, as measured and not filtered; CSV "
                   "instead of MAT"},
    BoardSource{.folder = "cycloidal",
                .title = "printed cycloidal drives with a clamped output, measured (a master's "
                         "thesis)",
                .address = "https://github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, commit "
                           "a5fe58d4, Code/test_data/*.csv",
                .licence = "CC BY-SA 4.0",
                .may_be_redistributed = true,
                .columns = "t_s, pos_out_deg, tau_motor_Nm, tau_cmd_Nm, iq_A, test_nr; the torque "
                           "is that of the motor's current"},
    BoardSource{.folder = "xl330_pendulum",
                .title = "a servo XL330 with a pendulum, measured (BAM, Rhoban)",
                .address = "https://github.com/Rhoban/bam, commit af22604, bam/data.bak/raw/*.json",
                .licence = "Apache-2.0",
                .may_be_redistributed = true,
                .columns = "JSON as published"}};

constexpr auto kFiles = std::to_array<BoardFile>({
#include "board_files.inc"
});

constexpr std::string_view kOtherPreloads =
    "ours: trained on all ramps of the file that ends in 1, tested on those of the files that end "
    "in 5 and 6, recorded at other preloads (recordings variant_0, variant_1, variant_2); on a "
    "clock of 400 Hz, the angle from the middle of its range";
constexpr std::string_view kOneCam =
    "ours: 60 blocks of one cycle, every fifth is tested, 50 ms at its borders are not used";
constexpr std::string_view kSupport =
    "ours: trained on supports at 0, 20, 30 and 45 mm, tested on one between them";

constexpr BoardSet cycloidal_set(std::string_view name, std::string_view title,
                                 std::string_view plan, std::size_t scored_samples) {
  return {.name = name,
          .title = title,
          .folder = "cycloidal",
          .data = plan,
          .recording = {},
          .split = kOtherPreloads,
          .target = "torque_Nm",
          .unit = "Nm",
          .initialise_samples = 50,
          .scored_samples = scored_samples};
}

constexpr BoardSet ankle_set(std::string_view name, std::string_view title, std::string_view plan,
                             std::string_view recording, std::string_view split,
                             std::size_t scored_samples) {
  return {.name = name,
          .title = title,
          .folder = "desr_foot",
          .data = plan,
          .recording = recording,
          .split = split,
          .target = "torque_Nm",
          .unit = "Nm",
          .initialise_samples = 100,  // until the filters of the inputs have settled
          .scored_samples = scored_samples};
}

constexpr std::array kSets{
    BoardSet{.name = "boucwen_multisine",
             .title = "Bouc-Wen, multisine",
             .folder = "boucwen",
             .data = "boucwen",
             .recording = "test_multisine",
             .split = "official test; trained on train_multisine, the record that dynoNet was "
                      "trained on: the benchmark prescribes none",
             .is_split_official = true,
             .target = "y_m",
             .unit = "m",
             .initialise_samples = 50,
             .scored_samples = 8142},
    BoardSet{.name = "boucwen_sinesweep",
             .title = "Bouc-Wen, sine sweep",
             .folder = "boucwen",
             .data = "boucwen",
             .recording = "test_sinesweep",
             .split = "official test; trained as for the multisine",
             .is_split_official = true,
             .target = "y_m",
             .unit = "m",
             .initialise_samples = 50,
             .scored_samples = 152950},
    BoardSet{.name = "emps",
             .title = "EMPS, pulses of force",
             .folder = "emps",
             .data = "emps",
             .recording = "emps_val",
             .split = "official: trained on emps_est, tested on emps_val",
             .is_split_official = true,
             .target = "qm_m",
             .unit = "m",
             .initialise_samples = 20,
             .scored_samples = 24821},
    ankle_set("desr_support_10mm", "DESR ankle, dual cam, support at 10 mm", "dual cam",
              "dualcam_x10", kSupport, 11900),
    ankle_set("desr_support_35mm", "DESR ankle, dual cam, support at 35 mm", "dual cam",
              "dualcam_x35", kSupport, 11900),
    ankle_set("desr_cam1", "DESR ankle, cam 1, blocks of one cycle", "cam1, held-out blocks", {},
              kOneCam, 2400),
    ankle_set("desr_cam2", "DESR ankle, cam 2, blocks of one cycle", "cam2, held-out blocks", {},
              kOneCam, 2400),
    cycloidal_set("cycloidal_base910_reamed", "cycloidal drive, base910_reamed",
                  "cycloidal base910_reamed, other preloads", 63602),
    cycloidal_set("cycloidal_base_onyx_runin", "cycloidal drive, base_onyx_runin",
                  "cycloidal base_onyx_runin, other preloads", 63608),
    cycloidal_set("cycloidal_split_onyx_runin", "cycloidal drive, split_onyx_runin",
                  "cycloidal split_onyx_runin, other preloads", 63609),
    cycloidal_set("cycloidal_split_onyx_6pre", "cycloidal drive, split_onyx_6pre",
                  "cycloidal split_onyx_6pre, other preloads", 63588),
    BoardSet{.name = "xl330_gain",
             .title = "servo XL330 with a pendulum, each gain left out",
             .folder = "xl330_pendulum",
             .data = "xl330",
             .recording = {},
             .split = "ours: each recording is simulated from its goals alone by a model that was "
                      "fitted to the recordings of the other three gains; the score is BAM's",
             .target = "joint_angle_rad",
             .unit = "rad",
             .hidden = {"joint_speed_rad_s", "duty_1"},
             .initialise_samples = 1,
             .scored_samples = 19184,
             .measure = BoardMeasure::mean_abs}};

constexpr std::string_view kSame = "same test";
constexpr std::string_view kSameTraining = "same training and test";
constexpr std::string_view kQuoted = "same test, as quoted by the source";
constexpr std::string_view kOtherRecord = "another test: a record of its authors";
constexpr std::string_view kIacob =
    "Iacob et al., Learning Koopman models from data under general noise conditions, Table 1";
constexpr std::string_view kDynoNet =
    "dynoNet paper, github.com/forgi86/dynonet, commit 56699401, doc/paper/ms.tex";
constexpr std::string_view kNoel = "Noel et al., arXiv 1610.09138";
constexpr std::string_view kChampneys = "Champneys et al. 2024, doi 10.1016/j.ifacol.2024.08.574";

consteval BoardPublished figure(std::string_view set, std::string_view benchmark,
                                std::string_view model, std::string_view condition,
                                std::string_view source) {
  const PaperFigure found = paper_figure(benchmark, "published", model, "RMSE");
  return {set, model, found.text, found.value, condition, source};
}
consteval BoardPublished boucwen(std::string_view model, std::string_view condition,
                                 std::string_view source) {
  return figure("boucwen_multisine", "boucwen", model, condition, source);
}
consteval BoardPublished emps(std::string_view model, std::string_view condition,
                              std::string_view source) {
  return figure("emps", "emps", model, condition, source);
}

constexpr std::array kPublished{
    boucwen("gr-SS-NN", kSame, kIacob), boucwen("SS-NN Suykens improved", kSame, kIacob),
    boucwen("polynomial state space", kSame, kIacob),
    boucwen("Koopman: input-affine", kSame, kIacob), boucwen("Koopman: general", kSame, kIacob),
    boucwen("SS-NN Suykens", kSame, kIacob), boucwen("Koopman: bilinear", kSame, kIacob),
    boucwen("Koopman: linear", kSame, kIacob), boucwen("dynoNet", kSameTraining, kDynoNet),
    boucwen("decoupled PNLSS", kQuoted, kDynoNet), boucwen("NFIR local models", kQuoted, kDynoNet),
    // Not in paper_figures.csv: another test, so that public-benchmarks does not show them.
    BoardPublished{"boucwen_multisine", "PNLSS 3-5-7", "1.21e-05", 1.21e-5, kOtherRecord, kNoel},
    BoardPublished{"boucwen_multisine", "PNLSS 2 to 7", "1.26e-05", 1.26e-5, kOtherRecord, kNoel},
    BoardPublished{"boucwen_multisine", "PNLSS 2-3-4-5", "1.81e-05", 1.81e-5, kOtherRecord, kNoel},
    BoardPublished{"boucwen_multisine", "PNLSS 2-3", "3.04e-05", 3.04e-5, kOtherRecord, kNoel},
    BoardPublished{"boucwen_multisine", "PNLSS 2", "5.42e-05", 5.42e-5, kOtherRecord, kNoel},
    emps("dynoNet", kSameTraining, kDynoNet), emps("LSTM", kSameTraining, kChampneys),
    emps("RNN", kSameTraining, kChampneys), emps("OLSTM", kSameTraining, kChampneys),
    emps("MLP of past inputs", kSameTraining, kChampneys), emps("GRU", kSameTraining, kChampneys)};

}  // namespace

std::string_view name(BoardMeasure measure) noexcept {
  return measure == BoardMeasure::rmse ? "RMSE" : "mean |error|";
}

std::span<const BoardSource> board_sources() noexcept { return kSources; }
std::span<const BoardFile> board_files() noexcept { return kFiles; }
std::span<const BoardSet> board_sets() noexcept { return kSets; }
std::span<const BoardPublished> board_published() noexcept { return kPublished; }

const BoardSet& find_board_set(std::string_view name, const std::string& place) {
  const auto* const found = std::ranges::find(kSets, name, &BoardSet::name);
  if (found != kSets.end()) return *found;
  std::array<std::string_view, kSets.size()> names{};
  std::ranges::transform(kSets, names.begin(), &BoardSet::name);
  throw UsageError({.place = place,
                    .problem = fmt::format("the board has no set \"{}\"", name),
                    .expected = fmt::format("one of {}", fmt::join(names, ", ")),
                    .advice = did_you_mean(name, names)});
}

const BoardSource& source_of(const BoardSet& set) {
  return *std::ranges::find(kSources, set.folder, &BoardSource::folder);
}

std::string unpacked_content(const std::string& path) {
  const std::unique_ptr<ByteSource> source = open_bytes(path);
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  std::vector<char> block(kBlock);
  std::string content;
  while (const std::size_t got = source->read(block.data(), block.size()))
    content.append(block.data(), got);
  return content;
}

std::string missing_file(const BoardSource& source, const std::string& folder) {
  for (const BoardFile& file : kFiles) {
    if (file.folder != source.folder) continue;
    std::string relative = fmt::format("{}/{}", file.folder, file.file);
    const std::string path = fmt::format("{}/{}", folder, relative);
    if (!std::filesystem::exists(path)) return relative;
    const std::string sha256 = sha256_hex(unpacked_content(path));
    if (sha256 != file.sha256)
      throw Error(
          {.place = path,
           .problem = "it is not the file that the board is about",
           .expected = fmt::format("SHA-256 {} of its unpacked content", file.sha256),
           .found = sha256,
           .advice = fmt::format("Fetch it again from {}, and convert it: tools/board_files "
                                 "ORIGINALS FOLDER.",
                                 source.address)});
  }
  return {};
}

}  // namespace torsio
