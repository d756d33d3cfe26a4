#pragma once

#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>

#include "store/database.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// The connection of a store, for any number of threads. If a server is lost, it connects again and
/// waits for it.
class StoreConnection {
 public:
  using Clock = std::chrono::steady_clock;

  /// Opens or creates the store and its tables.
  /// @param patience_s as `StudyStore`
  /// @throws Error also for tables of another version.
  explicit StoreConnection(const StoreAddress& address, StudyStore::OnWait on_wait = {},
                           double patience_s = 0.0);

  /// Repeats `work`, a transaction that has no effect if it happened before, while the server is lost.
  template <class Work>
  auto run(const Work& work) {
    const std::scoped_lock lock(guard_);
    for (;;) {
      try {
        return work(*database_);
      } catch (const ConnectionLost& lost) {
        wait_for_server(lost, std::numeric_limits<double>::infinity());
      }
    }
  }

  /// Since the connection was made again; infinite if it was never lost. Inside `run` only.
  [[nodiscard]] double seconds_since_outage() const;

 private:
  void wait_for_server(const ConnectionLost& lost, double patience_s);

  StoreAddress address_;
  StudyStore::OnWait on_wait_;
  std::mutex guard_;
  std::unique_ptr<Database> database_;
  std::optional<Clock::time_point> back_at_;  // after the last outage
};

}  // namespace torsio
