#include "search/slurm.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "common/output.hpp"
#include "torsio/core/error.hpp"
#include "torsio/search/workers.hpp"

namespace {

/// What a program wrote to standard output and error, and its exit code; none if it is not installed.
struct CommandOutput {
  int exit_code = 0;
  std::string text;
};

std::optional<CommandOutput> output_of(const std::vector<std::string>& command) {
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0)
    throw torsio::Error({.place = command.front(), .problem = "no pipe can be opened"});
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], STDERR_FILENO);
  std::vector<char*> arguments;
  std::vector<std::string> own = command;
  arguments.reserve(own.size() + 1);
  for (std::string& argument : own) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  pid_t process = 0;
  const int failure =
      posix_spawnp(&process, own.front().c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pipe_ends[1]);
  CommandOutput result;
  std::array<char, 4096> block{};
  for (ssize_t size = 0;
       failure == 0 && (size = ::read(pipe_ends[0], block.data(), block.size())) > 0;)
    result.text.append(block.data(), static_cast<std::size_t>(size));
  ::close(pipe_ends[0]);
  if (failure != 0) return std::nullopt;
  int status = 0;
  waitpid(process, &status, 0);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  while (!result.text.empty() && result.text.back() == '\n') result.text.pop_back();
  return result;
}

/// A word of a shell script as it is.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word)
    if (c == '\'')
      text += "'\\''";
    else
      text += c;
  return text + "'";
}

std::string script_of(const SlurmFlags& flags, const WorkerFlags& worker,
                      const torsio::StoredStudy& study) {
  const std::size_t threads = worker.threads == 0 ? 1 : worker.threads;
  std::string text = fmt::format(
      "#!/bin/sh\n"
      "#SBATCH --job-name=torsio-{0}\n"
      "#SBATCH --array=1-{1}\n"
      "#SBATCH --cpus-per-task={2}\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "#SBATCH --output={0}-%A_%a.log\n",
      study.name, flags.workers, threads);
  for (const std::string& option : flags.options) text += "#SBATCH " + option + "\n";
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  text +=
      fmt::format("exec {} work --store {} --study {} --threads {} --lease {}\n", quoted(program),
                  quoted(worker.store), quoted(study.name), threads, quoted(worker.lease));
  return text;
}

/// Only its owner may read the script: the URL in it may have a password.
void write_script(const std::string& path, const std::string& text) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  const bool is_written = descriptor >= 0 && ::write(descriptor, text.data(), text.size()) ==
                                                 static_cast<ssize_t>(text.size());
  if (descriptor >= 0) ::close(descriptor);
  if (!is_written)
    throw torsio::Error({.place = path,
                         .problem = "the script of the job cannot be written",
                         .advice = "Start the command in a folder that you may write to."});
}

std::string submit(const std::string& path) {
  const auto output = output_of({"sbatch", "--parsable", path});
  if (!output)
    throw torsio::Error({.place = "--engine slurm",
                         .problem = "there is no program sbatch on this machine",
                         .advice = fmt::format("Submit {} from a login node of the cluster, or "
                                               "start torsio work by hand on each machine.",
                                               path)});
  if (output->exit_code != 0)
    throw torsio::Error({.place = "sbatch " + path,
                         .problem = output->text,
                         .advice = "Correct the options with --slurm-option, or the number of "
                                   "workers, and start the command again."});
  return output->text.substr(0, output->text.find(';'));
}

/// Whether Slurm still has tasks of the job, or does not answer.
bool has_tasks(const std::string& job) {
  const auto output = output_of({"squeue", "--noheader", "--jobs", job});
  if (!output || output->exit_code != 0)
    return output && output->text.find("Invalid job id") == std::string::npos;
  return !output->text.empty();
}

}  // namespace

void SlurmFlags::add(CLI::App& verb) {
  verb.add_option("--workers", workers, "tasks of the job array of --engine slurm")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100'000}))
      ->capture_default_str();
  verb.add_option("--slurm-option", options,
                  "a line of the job's script: --slurm-option=--partition=long; may be repeated");
  verb.add_flag("--submit-only", only_submits,
                "end after the job of --engine slurm is submitted; the same command without these "
                "two options shows the table later");
}

bool run_on_slurm(const SlurmFlags& flags, const WorkerFlags& worker, torsio::StudyStore& store,
                  const torsio::StoredStudy& study, torsio::StudyKind& kind,
                  const torsio::Progress& progress) {
  if (store.counts(study.id).is_complete() && !torsio::advance(store, study, kind)) return true;
  const std::string path = study.name + ".sbatch";
  write_script(path, script_of(flags, worker, study));
  const std::string job = submit(path);
  const std::string submitted =
      fmt::format("job {}: {} workers ({}); scancel {} stops them", job, flags.workers, path, job);
  if (flags.only_submits) {
    remark(submitted +
           ". The same command without --engine slurm and --submit-only shows the table later; "
           "trials that are left then are run by it.");
    return false;
  }
  remark(submitted);
  constexpr int kPollsPerQuestion = 20;
  for (int poll = 0;; ++poll) {
    if (!torsio::advance(store, study, kind)) {
      const torsio::StudyCounts counts = store.counts(study.id);
      if (counts.is_complete()) return true;
      const double fraction = counts.finished_priority / std::max(counts.total_priority, 1e-12);
      if (progress &&
          !progress(fraction, fmt::format("{} of {} trials, {} running", counts.finished,
                                          counts.total(), counts.running)))
        throw torsio::Cancelled();
      if (poll % kPollsPerQuestion == kPollsPerQuestion - 1 && !has_tasks(job))
        throw torsio::Error(
            {.place = "job " + job,
             .problem = fmt::format("no worker is left, but {} trials have not finished",
                                    counts.waiting + counts.running),
             .advice = fmt::format("Read {}-{}_*.log, and start the command again: it continues.",
                                   study.name, job)});
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}
