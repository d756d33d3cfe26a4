#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/store/store_address.hpp"

namespace torsio {

class StoreConnection;

enum class TrialState : std::uint8_t { waiting, running, done, failed, pruned };
[[nodiscard]] std::string_view name(TrialState state) noexcept;

/// What is to be computed for one result: a fit of one structure on one fold, one specimen.
struct Trial {
  std::string key;          ///< unique within study and step: "mlp:layers=16-16|fold 2"
  std::string spec = {};    ///< what the study's kind needs to run it
  std::string group = {};   ///< trials between which halving steps choose; a family
  std::string device = {};  ///< serial number of the device that it is about; may be empty
  int step = 0;             ///< halving step, from 0
  double priority = 0.0;    ///< higher ones are claimed first: the expected time in seconds
};

/// A study: a list of trials of one kind.
struct StoredStudy {
  std::int64_t id = 0;
  std::string name;
  std::string kind;            ///< "search"
  std::string spec;            ///< all that a worker needs, as JSON
  std::string torsio_version;  ///< version of the program that began it
};

/// A trial that this worker runs until its lease ends. `attempt` counts the claims of this trial:
/// only the last one may write a result.
struct Claim {
  std::int64_t trial = 0;
  std::int64_t study = 0;
  std::int64_t attempt = 0;
  std::string key;
  std::string spec;
  std::string group;
  std::string device;
  int step = 0;
  bool runs_alone = false;  ///< the worker is to run no other trial meanwhile
};

/// The result of a trial. Times are for information: they are not the same in every run.
struct TrialResult {
  bool is_failed = false;
  double value = kNotMeasured;  ///< by which trials are ranked, lowest first; NaN: not ranked
  std::string reason = {};      ///< why it failed
  std::string result = {};      ///< all scores, as JSON
  std::string samples = {};     ///< large bytes, kept apart; may be empty
  double seconds = 0.0;
};

/// A trial of a study with its state and result.
struct TrialRecord {
  std::int64_t id = 0;
  Trial trial;
  TrialState state = TrialState::waiting;
  std::int64_t attempt = 0;
  std::string worker = {};  ///< that runs it or ran it last
  TrialResult result = {};
};

struct StudyCounts {
  std::size_t waiting = 0;
  std::size_t running = 0;
  std::size_t finished = 0;        ///< done, failed or pruned
  double finished_priority = 0.0;  ///< the sum of the priorities of these
  double total_priority = 0.0;
  [[nodiscard]] std::size_t total() const noexcept { return waiting + running + finished; }
  [[nodiscard]] bool is_complete() const noexcept { return waiting + running == 0; }
};

/// The decision after a halving step of a group.
struct HalvingDecision {
  struct Pruned {
    std::int64_t trial = 0;
    std::string reason;
  };
  std::vector<Pruned> pruned = {};
  std::vector<Trial> next = {};
};

/// Studies and their trials in SQLite or PostgreSQL, shared by the workers on any number of
/// machines. A trial is claimed with a lease by the clock of the database; a worker that is killed
/// or stopped for longer loses it, and its result is refused if it comes after all. So each trial has
/// exactly one result.
///
/// A trial that may be what its worker was lost of is claimed by workers that run nothing else; three
/// losses there, and it has failed. Losses together with other trials of a worker, and of workers that
/// turn out to run, make no trial fail.
///
/// All functions may be called by several threads. If a server is lost, they connect again and wait
/// for it (`on_wait`), and repeat the transaction, which has no effect if it had happened.
/// @throws Error as the database does: full disk, read only, no permission.
class StudyStore {
 public:
  /// Called once when the server is lost and again when it is back (empty reason), and in between
  /// each second (same reason): false ends the waiting with `Cancelled`.
  using OnWait = std::function<bool(const std::string& reason)>;

  /// Opens or creates the store and its tables. A server that is starting is waited for.
  /// @param patience_s for how long one is waited for that cannot be reached at first
  /// @throws Error also for a wrong address or password, and for a store of a newer version.
  explicit StudyStore(const StoreAddress& address, OnWait on_wait = {}, double patience_s = 0.0);
  ~StudyStore();
  StudyStore(const StudyStore&) = delete;
  StudyStore& operator=(const StudyStore&) = delete;

  [[nodiscard]] const StoreAddress& address() const noexcept { return address_; }

  /// The study of that name with its trials; one that exists is resumed, which adds nothing.
  /// @throws UsageError if the study of that name is another one or of another version of torsio.
  StoredStudy create_or_resume(const StoredStudy& study, std::span<const Trial> trials);
  [[nodiscard]] std::optional<StoredStudy> find_study(std::string_view name);
  [[nodiscard]] std::vector<StoredStudy> studies();

  /// The waiting trial of the highest priority; none: all are done or run elsewhere. The trials of
  /// other workers whose leases ended are taken back first.
  /// @param worker a name that no other process has
  /// @param runs_nothing whether this worker runs no trial at the moment
  [[nodiscard]] std::optional<Claim> claim(std::int64_t study, const std::string& worker,
                                           double lease_s, bool runs_nothing = true);
  /// Extends the lease. @returns false if another worker has the trial by now.
  bool extend(const Claim& claim, double lease_s);
  /// Writes the result. @returns false, and writes nothing, if the lease was lost.
  bool finish(const Claim& claim, const TrialResult& result);
  /// Gives the trial back, which counts as no loss: the user stopped the worker.
  void give_back(const Claim& claim);
  /// Call once for a claim that was lost: the worker runs, so that the trial was not the cause.
  void withdraw_loss(const Claim& claim);

  /// Takes trials back before their leases end, where `is_dead` is certain that the worker of that
  /// name does not run any more. It is a loss. @returns their keys.
  std::vector<std::string> take_back(std::int64_t study,
                                     const std::function<bool(const std::string& worker)>& is_dead);

  /// Where all trials of a group's halving step have finished and nothing was decided yet, calls
  /// `decide` with them, in the order of their numbers, and enters its decision; for one worker at a
  /// time. @returns whether anything was decided.
  bool advance(std::int64_t study,
               const std::function<HalvingDecision(const std::string& group, int step,
                                                   std::span<const TrialRecord>)>& decide);

  [[nodiscard]] StudyCounts counts(std::int64_t study);
  /// All trials in the order of their numbers, without `samples`.
  [[nodiscard]] std::vector<TrialRecord> trials(std::int64_t study);
  /// A page of the table, lowest value first: the first one, or that after the last of another page.
  [[nodiscard]] std::vector<TrialRecord> best(std::int64_t study, std::size_t count,
                                              const TrialRecord* after = nullptr);
  /// All trials about a device, of all studies, oldest first.
  [[nodiscard]] std::vector<TrialRecord> history(std::string_view device);
  [[nodiscard]] std::string samples(std::int64_t trial);

 private:
  template <class Work>
  auto with_connection(const Work& work);

  StoreAddress address_;
  std::unique_ptr<StoreConnection> connection_;
};

/// A study of another version is not continued.
/// @param place of the store
/// @throws Error that names both.
void refuse_other_version(const StoredStudy& study, std::string_view version,
                          const std::string& place);

}  // namespace torsio
