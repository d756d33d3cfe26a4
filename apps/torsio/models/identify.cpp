#include "report/identify.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/drive/drive_file.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/identify/drive/write_drive.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/signal/feature_pipeline.hpp"
#include "verbs.hpp"

namespace {

struct DriveIdentifyFlags {
  DataFlags data;
  std::string from;  ///< file of an identified drive; empty: one is identified
  std::string load;
  std::string drive;
  std::string terms = "auto";
  std::string group_by;
  std::string step;
  std::size_t starts = torsio::IdentifyOptions{}.starts;
  std::size_t threads = 0;
  std::uint64_t seed = kDefaultSeed;
  bool has_spring = false;
  bool without_errors = false;
  bool without_nested = false;
  std::string output;
  std::vector<std::pair<std::string, std::string>> written;  ///< target and file
  std::string name = "servo";
  JsonOutput json;
  ReportOutput report;
};

torsio::DriveTerms all_terms() { return torsio::DriveTerms().set(); }

torsio::IdentifyOptions options_of(const DriveIdentifyFlags& flags,
                                   const torsio::Progress& progress) {
  torsio::IdentifyOptions options{.group_by = flags.group_by,
                                  .starts = flags.starts,
                                  .has_standard_errors = !flags.without_errors,
                                  .has_nested_score = !flags.without_nested,
                                  .seed = flags.seed,
                                  .threads = flags.threads,
                                  .progress = progress};
  if (!flags.step.empty()) {
    options.step_s = torsio::signed_quantity_with_unit(flags.step, "s", "--step");
    constexpr double kShortest_s = 1e-5;
    constexpr double kLongest_s = 0.1;
    if (!(options.step_s >= kShortest_s && options.step_s <= kLongest_s))
      throw torsio::UsageError(
          {.place = "--step", .expected = "a time from 0.01ms to 100ms", .found = flags.step});
  }
  if (flags.terms != "auto")
    options.terms = torsio::drive_terms_named(torsio::split_inputs(flags.terms), "--terms",
                                              "auto, or terms of ");
  else if (flags.has_spring)
    options.largest = all_terms();
  return options;
}

std::vector<torsio::Recording> recordings_of(const DriveIdentifyFlags& flags,
                                             const torsio::Progress& progress) {
  std::vector<torsio::Recording> recordings;
  for (const std::string& file : flags.data.recordings)
    for (torsio::Recording& recording :
         torsio::load_recordings(file, flags.data.load_options(progress)))
      recordings.push_back(std::move(recording));
  std::vector<const torsio::Recording*> all;
  all.reserve(recordings.size());
  for (const torsio::Recording& recording : recordings) all.push_back(&recording);
  DataFlags::remark_on_reading(all);
  return recordings;
}

std::string written_text(const std::string& target, const std::string& file,
                         const torsio::WrittenDrive& written) {
  std::string missing;
  for (const std::string& term : written.not_expressed)
    missing += (missing.empty() ? "" : ", ") + term;
  return fmt::format(
      "{} written for {}{}: {:.4f} rad mean |error| there, {:.4f} rad here; not expressed: {}",
      file, target, written.model.empty() ? "" : " (" + written.model + ")", written.mae_rad,
      written.own_mae_rad, missing.empty() ? "nothing" : missing);
}

void check_call(DriveIdentifyFlags& flags) {
  (void)options_of(flags, {});
  const bool has_load = !flags.load.empty() || !flags.from.empty();
  if (flags.data.recordings.empty() || !has_load)
    throw torsio::UsageError(
        {.place = "torsio identify",
         .expected = "recordings, and --load load.yaml, the known load that gives the torque its "
                     "scale, or --from servo.json, a drive that was identified",
         .found = flags.data.recordings.empty() ? "no recordings" : "no --load",
         .advice = "Example: torsio identify logs/*.json.gz --load pendulum.yaml -o servo.json"});
  if (flags.has_spring && flags.terms != "auto")
    throw torsio::UsageError(
        {.place = "--spring",
         .expected = "--terms auto, whose choice then begins with the terms of a spring",
         .found = "--terms " + flags.terms,
         .advice = "Name the terms: --terms spring,hysteresis,.. without --spring."});
  std::vector<std::string> inputs;
  for (const std::string& file : {flags.from, flags.load, flags.drive})
    if (!file.empty()) inputs.push_back(file);
  std::vector<std::string> outputs{flags.output, flags.json.destination, flags.report.destination,
                                   flags.report.plot};
  for (const auto& [target, file] : flags.written) {
    // The law is looked at when it is known.
    torsio::require_writable(torsio::drive_target(target), torsio::DriveLaw::position, flags.name);
    outputs.push_back(file);
  }
  flags.data.check_outputs(outputs, inputs);
}

torsio::DriveSheet drive_of(const DriveIdentifyFlags& flags, const torsio::Recording& recording) {
  if (!flags.drive.empty()) return torsio::read_drive_sheet(flags.drive);
  torsio::DriveSheet drive = torsio::assumed_drive_sheet(recording);
  const std::vector<std::string> commands = torsio::command_channels(drive.law);
  remark(fmt::format("note: no --drive; the channels suggest the law '{}', with the command {}",
                     torsio::name(drive.law), commands.front()));
  return drive;
}

void require_writable(const DriveIdentifyFlags& flags, torsio::DriveLaw law) {
  for (const auto& [target, file] : flags.written)
    torsio::require_writable(torsio::drive_target(target), law, flags.name);
}

/// The drive of `--from` with the errors of these recordings; another load or law replaces that of the file.
torsio::DriveIdentification evaluated_drive(const DriveIdentifyFlags& flags,
                                            const std::vector<torsio::Recording>& recordings) {
  torsio::DriveIdentification identified = torsio::read_identified_drive(flags.from);
  if (!flags.load.empty()) identified.load = torsio::read_load_sheet(flags.load);
  if (!flags.drive.empty()) {
    const torsio::DriveLaw law = identified.drive.law;
    const std::optional<double> error_gain_1_rad = identified.drive.error_gain_1_rad;
    identified.drive = torsio::read_drive_sheet(flags.drive);
    if (identified.drive.law != law)
      throw torsio::UsageError(
          {.place = "--drive",
           .expected = fmt::format("the law '{}' of {}, for which its values were found",
                                   torsio::name(law), flags.from),
           .found = std::string(torsio::name(identified.drive.law))});
    if (!identified.drive.error_gain_1_rad) identified.drive.error_gain_1_rad = error_gain_1_rad;
  }
  require_writable(flags, identified.drive.law);
  return torsio::evaluate_drive(identified, recordings, flags.group_by);
}

torsio::DriveIdentification identified_drive(const DriveIdentifyFlags& flags,
                                             const torsio::LoadSheet& load,
                                             const std::vector<torsio::Recording>& recordings,
                                             const torsio::IdentifyOptions& options) {
  const torsio::DriveSheet drive = drive_of(flags, recordings.front());
  require_writable(flags, drive.law);
  return torsio::identify_drive(recordings, load, drive, options);
}

void write_files(const DriveIdentifyFlags& flags, const torsio::DriveIdentification& identified,
                 const std::vector<torsio::Recording>& recordings,
                 const torsio::IdentifyOptions& options) {
  std::vector<torsio::WrittenDrive> written;
  written.reserve(flags.written.size());
  for (const auto& [target, file] : flags.written)
    written.push_back(torsio::write_drive(torsio::drive_target(target), identified, recordings,
                                          flags.name, options));
  for (std::size_t k = 0; k < written.size(); ++k) {
    write_text(flags.written[k].second, written[k].text);
    remark(written_text(flags.written[k].first, flags.written[k].second, written[k]));
  }
}

void run(DriveIdentifyFlags& flags) {
  check_call(flags);
  const bool is_evaluation = !flags.from.empty();
  std::optional<torsio::LoadSheet> load;  // a mistake in it is found before the recordings are read
  if (!is_evaluation) load = torsio::read_load_sheet(flags.load);
  ProgressBar progress;
  const std::vector<torsio::Recording> recordings = recordings_of(flags, progress.listener());
  const torsio::IdentifyOptions options = options_of(flags, progress.listener());
  const torsio::DriveIdentification identified =
      is_evaluation ? evaluated_drive(flags, recordings)
                    : identified_drive(flags, *load, recordings, options);
  std::vector<torsio::DriveAdvice> advice;
  if (!is_evaluation) advice = torsio::advise_drive(identified, recordings);
  if (flags.json.wants_tables())
    print(is_evaluation
              ? torsio::drive_evaluation_text(identified)
              : torsio::identification_text(identified) + "\n" + torsio::drive_advice_text(advice));
  const std::string document = torsio::identification_json(identified, advice);
  flags.json.write(document);
  write_files(flags, identified, recordings, options);
  if (!flags.output.empty()) write_text(flags.output, document);
  if (flags.report.is_wanted())
    flags.report.write(torsio::identification_report(identified, recordings, advice));
}

/// What would have no effect on a drive that is only evaluated is refused.
void exclude_from(CLI::App& verb, CLI::Option& from) {
  for (const char* option :
       {"--terms", "--spring", "--step", "--no-standard-errors", "--no-nested", "--output"})
    from.excludes(verb.get_option(option));
}

void add_fit_options(CLI::App& verb, DriveIdentifyFlags& flags) {
  verb.add_option("--terms", flags.terms,
                  "terms of the model beyond the base, separated by commas; auto: chosen by "
                  "leaving out recordings")
      ->capture_default_str();
  verb.add_flag("--spring", flags.has_spring,
                "with --terms auto: begin with a second mass and its spring, hysteresis, backlash "
                "and bearing");
  verb.add_option("--group-by", flags.group_by,
                  "condition whose equal values are left out together, or 'recording' (default: "
                  "by the number of recordings)");
  verb.add_option("--starts", flags.starts, "starts of each search")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  verb.add_option("--step", flags.step,
                  "longest step of the integrator (default: 2.5ms; with a spring 1ms)");
  verb.add_option("--threads", flags.threads,
                  "threads; the result does not depend on it (default: all)")
      ->check(CLI::Range(0, 1024));
  verb.add_flag("--no-standard-errors", flags.without_errors,
                "skip the fits without one recording each");
  verb.add_flag("--no-nested", flags.without_nested,
                "skip the choice of the terms without each group");
  add_seed(verb, flags.seed, "seed of the starts");
}

void add_output_options(CLI::App& verb, DriveIdentifyFlags& flags) {
  verb.add_option("-o,--output", flags.output,
                  "file of the identified drive (JSON), for --from; untouched unless the work "
                  "succeeds");
  CLI::Option* const write =
      verb.add_option("--write", flags.written,
                      "TARGET FILE: the drive for another program, bam, mjcf or isaaclab, refitted "
                      "with its step; repeatable")
          ->type_name("TARGET FILE");
  verb.add_option("--name", flags.name, "of the actuator in these files")
      ->needs(write)
      ->capture_default_str();
}

}  // namespace

void add_identify(CLI::App& app) {
  auto flags = std::make_shared<DriveIdentifyFlags>();
  CLI::App* verb = app.add_subcommand("identify",
                                      "motor, friction and spring of a joint from its command, its "
                                      "angle and a known load, without a torque sensor");
  verb->footer(
      "Example: torsio identify logs/*.json.gz --load pendulum.yaml -o servo.json\n"
      "         torsio identify new.json.gz --from servo.json --write mjcf servo.xml\n"
      "docs/use/identify.md has the equations, the files and what to record.");
  flags->data.add_recordings(*verb, "recordings of the joint moving the load, or manifests");
  flags->data.add_mapping(*verb);
  CLI::Option* const from = verb->add_option(
      "--from", flags->from,
      "file of an identified drive (-o): its free runs through these recordings, without a fit; "
      "--load and --drive replace what it states");
  verb->add_option("--load", flags->load, "file of the known load (docs/use/known_load.md)");
  verb->add_option("--drive", flags->drive, "file of the drive's law; default: by the channels");
  add_fit_options(*verb, *flags);
  add_output_options(*verb, *flags);
  flags->json.add(*verb, "the result");
  flags->report.add(*verb, "Mean |error");
  exclude_from(*verb, *from);
  verb->callback([flags] { run(*flags); });
}
