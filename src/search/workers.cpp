#include "torsio/search/workers.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <list>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "numerics/thread_share.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPoll = std::chrono::milliseconds(50);
constexpr auto kReport = std::chrono::milliseconds(200);
constexpr auto kLongestPoll = std::chrono::milliseconds(1000);

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A trial of this process.
struct RunningTrial {
  Claim claim;
  std::string label;
  std::atomic<double> fraction = 0.0;
  std::atomic<bool> is_lost = false;
};

std::string remaining_text(double seconds) {
  if (seconds < 90.0) return fmt::format("about {:.0f} s left", seconds);
  constexpr double kMinute = 60.0;
  if (seconds < 90.0 * kMinute) return fmt::format("about {:.0f} min left", seconds / kMinute);
  return fmt::format("about {:.1f} h left", seconds / (kMinute * kMinute));
}

/// The threads of one call of `run_workers`.
class Workers {
 public:
  Workers(StudyStore& store, const StoredStudy& study, StudyKind& kind,
          const WorkerOptions& options)
      : store_(store), study_(study), kind_(kind), options_(options) {
    threads_ = options.threads == 0 ? usual_threads() : options.threads;
    if (options_.name.empty()) options_.name = worker_name();
  }

  WorkersReport run(const Progress& progress) {
    start_ = Clock::now();
    at_start_ = store_.counts(study_.id);
    counts_ = at_start_;
    counted_ = start_;
    {
      std::jthread extending([this] {
        guarded([this] {
          try {
            extend_leases();
          } catch (const Cancelled&) {  // it was waiting for the server when all others had ended
          }
        });
      });
      std::vector<std::jthread> threads;
      threads.reserve(threads_);
      active_ = threads_;
      for (std::size_t k = 0; k < threads_; ++k)
        threads.emplace_back([this] {
          guarded([this] { work(); });
          const std::scoped_lock lock(guard_);
          --active_;
          changed_.notify_all();
        });
      guarded([&] { watch(progress); });
      threads.clear();  // waits for them
      const std::scoped_lock lock(guard_);
      stop_ = true;
      changed_.notify_all();
    }
    if (failure_) std::rethrow_exception(failure_);
    if (is_cancelled_) throw Cancelled();
    return {.finished = finished_, .lost = lost_};
  }

 private:
  /// The first exception of any thread stops all of them.
  template <class Work>
  void guarded(const Work& own_work) {
    try {
      own_work();
    } catch (const Cancelled&) {
      is_cancelled_ = true;
      stop_ = true;
    } catch (...) {
      const std::scoped_lock lock(guard_);
      if (!failure_) failure_ = std::current_exception();
      stop_ = true;
    }
    changed_.notify_all();
  }

  void work() {
    auto pause = kPoll;
    auto last_claim = Clock::now();
    while (!stop_) {
      if (RunningTrial* const trial = claim()) {
        run_trial(*trial);
        advance();
        pause = kPoll;
        last_claim = Clock::now();
        continue;
      }
      if (advance()) continue;
      const StudyCounts counts = store_.counts(study_.id);
      if (counts.is_complete() && !advance()) return;
      // Others run the rest. One of them that was killed loses its trial within a lease.
      if (!options_.until_complete && counts.waiting == 0 && !may_get_more() &&
          seconds_since(last_claim) > kWorkerPatience * options_.lease_s)
        return;
      std::unique_lock lock(guard_);
      changed_.wait_for(lock, pause, [this] { return stop_.load(); });
      pause = std::min(2 * pause, kLongestPoll);
    }
  }

  /// Whether a trial of this process is running, after which a halving step may bring new ones.
  bool may_get_more() {
    const std::scoped_lock lock(guard_);
    return !running_.empty();
  }

  bool advance() { return torsio::advance(store_, study_, kind_); }

  /// One thread at a time: a trial that runs alone must not begin together with another one.
  RunningTrial* claim() {
    const std::scoped_lock lock(claiming_);
    bool runs_nothing = false;
    {
      const std::scoped_lock state_lock(guard_);
      if (!running_.empty() && running_.front().claim.runs_alone) return nullptr;
      runs_nothing = running_.empty();
    }
    const std::optional<Claim> claim =
        store_.claim(study_.id, options_.name, options_.lease_s, runs_nothing);
    return claim ? add(*claim) : nullptr;
  }

  void run_trial(RunningTrial& trial) {
    const Claim& claim = trial.claim;
    struct Removal {
      Workers& workers;
      const RunningTrial& trial;
      ~Removal() { workers.remove(trial); }
    } const removal{*this, trial};
    const ThreadShare share(&share_);
    const auto begin = Clock::now();
    TrialResult result;
    try {
      {
        const std::scoped_lock lock(guard_);
        trial.label = kind_.label(claim);
      }
      result = kind_.run(claim, [&](double fraction, std::string_view) {
        trial.fraction.store(fraction, std::memory_order_relaxed);
        return !stop_ && !trial.is_lost;
      });
    } catch (const Cancelled&) {
      if (trial.is_lost) return count_lost(claim);
      store_.give_back(claim);
      throw;
    } catch (const Error&) {
      store_.give_back(claim);
      throw;
    }
    result.seconds = seconds_since(begin);
    if (!finish(claim, result)) return count_lost(claim);
    ++finished_;
  }

  bool finish(const Claim& claim, const TrialResult& result) {
    try {
      return store_.finish(claim, result);
    } catch (const Error&) {
      // The result cannot be written, for example to a full disk: that the trial waits again may be.
      try {
        store_.give_back(claim);
      } catch (const Error&) {  // the first error is the one to report
      }
      throw;
    }
  }

  void count_lost(const Claim& claim) {
    ++lost_;
    store_.withdraw_loss(claim);
  }

  RunningTrial* add(const Claim& claim) {
    const std::scoped_lock lock(guard_);
    RunningTrial& trial = running_.emplace_back();
    trial.claim = claim;
    share_ = std::max<std::size_t>(1, threads_ / running_.size());
    return &trial;
  }

  void remove(const RunningTrial& trial) {
    const std::scoped_lock lock(guard_);
    running_.remove_if([&](const RunningTrial& each) { return &each == &trial; });
    share_ = std::max<std::size_t>(1, threads_ / std::max<std::size_t>(1, running_.size()));
  }

  /// With a connection of its own, but for a store in memory: the other one may wait.
  void extend_leases() {
    std::optional<StudyStore> own_store;
    if (store_.address().kind != StoreAddress::Kind::memory)
      own_store.emplace(
          store_.address(), [this](const std::string& /*reason*/) { return !stop_; },
          std::numeric_limits<double>::infinity());
    StudyStore& store = own_store ? *own_store : store_;
    const auto pause = std::chrono::duration<double>(options_.lease_s / 3.0);
    while (true) {
      std::vector<Claim> claims;
      {
        std::unique_lock lock(guard_);
        changed_.wait_for(lock, pause, [this] { return stop_ && active_ == 0; });
        if (stop_ && active_ == 0) return;
        for (const RunningTrial& trial : running_) claims.push_back(trial.claim);
      }
      for (const Claim& claim : claims)
        if (!store.extend(claim, options_.lease_s)) note_lost(claim);
    }
  }

  void note_lost(const Claim& claim) {
    const std::scoped_lock lock(guard_);
    for (RunningTrial& trial : running_)
      if (trial.claim.trial == claim.trial && trial.claim.attempt == claim.attempt)
        trial.is_lost = true;
  }

  /// Reports progress until all threads have ended.
  void watch(const Progress& progress) {
    while (active_ > 0) {
      {
        std::unique_lock lock(guard_);
        changed_.wait_for(lock, kReport, [this] { return active_ == 0; });
      }
      if (!progress || stop_ || active_ == 0) continue;
      const auto [fraction, doing] = state();
      if (progress(fraction, doing)) continue;
      is_cancelled_ = true;
      stop_ = true;
      changed_.notify_all();
    }
  }

  /// The share of the expected work that is done, and what is being done.
  std::pair<double, std::string> state() {
    if (seconds_since(counted_) >= 1.0) {
      counts_ = store_.counts(study_.id);
      counted_ = Clock::now();
    }
    const StudyCounts& counts = counts_;
    std::string doing = fmt::format("{} of {} trials", counts.finished, counts.total());
    const std::scoped_lock lock(guard_);
    for (const RunningTrial& trial : running_)
      doing += fmt::format("{}{} {:.0f} %", &trial == &running_.front() ? "; " : ", ", trial.label,
                           100.0 * trial.fraction.load(std::memory_order_relaxed));
    const double total = std::max(counts.total_priority, 1e-12);
    const double fraction = std::clamp(counts.finished_priority / total, 0.0, 1.0);
    const double since = (counts.finished_priority - at_start_.finished_priority) / total;
    constexpr double kEnough = 0.02;
    if (since > kEnough)
      doing += "; " + remaining_text(seconds_since(start_) * (1.0 - fraction) / since);
    return {fraction, doing};
  }

  StudyStore& store_;
  const StoredStudy& study_;
  StudyKind& kind_;
  WorkerOptions options_;
  std::size_t threads_ = 1;

  std::mutex claiming_;
  std::mutex guard_;
  std::condition_variable changed_;
  std::list<RunningTrial> running_;
  std::exception_ptr failure_;

  std::atomic<bool> stop_ = false;
  std::atomic<std::size_t> active_ = 0;
  std::atomic<std::size_t> share_ = 1;
  std::atomic<std::size_t> finished_ = 0;
  std::atomic<std::size_t> lost_ = 0;
  std::atomic<bool> is_cancelled_ = false;
  Clock::time_point start_;
  Clock::time_point counted_;
  StudyCounts counts_;
  StudyCounts at_start_;
};

}  // namespace

WorkersReport run_workers(StudyStore& store, const StoredStudy& study, StudyKind& kind,
                          const WorkerOptions& options, const Progress& progress) {
  return Workers(store, study, kind, options).run(progress);
}

bool advance(StudyStore& store, const StoredStudy& study, StudyKind& kind) {
  return store.advance(
      study.id, [&](const std::string& group, int step, std::span<const TrialRecord> trials) {
        return kind.decide(group, step, trials);
      });
}

std::string worker_name() {
  // A process in a container often has the number that the one before it had.
  static const auto token = std::random_device()();
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  return fmt::format("{}:{}:{:08x}", host[0] == '\0' ? "host" : host.data(), getpid(), token);
}

}  // namespace torsio
