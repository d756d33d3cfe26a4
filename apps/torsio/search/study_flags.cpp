#include "search/study_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <mutex>
#include <string_view>

#include "common/interrupt.hpp"
#include "common/output.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"

void WorkerFlags::add(CLI::App& verb, const char* store_help, const char* study_help) {
  verb.add_option("--store", store, store_help);
  verb.add_option("--study", study, study_help);
  verb.add_option("--threads", threads,
                  "trials that run at the same time (default: one for each core that this process "
                  "may use)");
  verb.add_option("--lease", lease,
                  "after this time without a sign of a worker its trial is given to another one")
      ->capture_default_str();
}

torsio::WorkerOptions WorkerFlags::options() const {
  const double lease_s = torsio::signed_quantity_with_unit(lease, "s", "--lease");
  constexpr double kLeast_s = 1.0;
  if (!(lease_s >= kLeast_s))
    throw torsio::UsageError({.place = "--lease", .expected = "at least 1s", .found = lease});
  return {.threads = threads, .lease_s = lease_s};
}

std::string counted(std::size_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

bool wait_for_server(const std::string& reason) {
  static std::mutex guard;
  static bool is_lost = false;
  const std::scoped_lock lock(guard);
  if (!reason.empty() && !is_lost)
    remark(reason +
           " It is tried again until it is back; results are kept meanwhile, and Ctrl-C "
           "stops.");
  if (reason.empty() && is_lost) remark("the server is back");
  is_lost = !reason.empty();
  return !is_interrupted();
}

void take_back_of_dead(torsio::StudyStore& store, const torsio::StoredStudy& study) {
  if (store.address().kind != torsio::StoreAddress::Kind::sqlite) return;  // one machine
  const std::string own = torsio::worker_name();
  const std::string host = own.substr(0, own.find(':') + 1);
  const auto keys = store.take_back(study.id, [&](const std::string& worker) {
    if (!worker.starts_with(host)) return false;
    pid_t process = 0;
    const char* const end = worker.data() + worker.size();
    const auto [at, code] = std::from_chars(worker.data() + host.size(), end, process);
    return code == std::errc{} && at != end && *at == ':' && kill(process, 0) != 0 &&
           errno == ESRCH;
  });
  if (!keys.empty())
    remark(fmt::format("{} when the program that ran {} was killed, and {} run again: {}",
                       keys.size() == 1 ? "a trial was running"
                                        : fmt::format("{} trials were running", keys.size()),
                       keys.size() == 1 ? "it" : "them", keys.size() == 1 ? "is" : "are",
                       fmt::join(keys, "; ")));
}
