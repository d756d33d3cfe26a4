// store_times STORE TRIALS: how long a store takes. Prints one line of JSON, in milliseconds: a trial's claim, finish and
// question for halving steps in a small study and in one of TRIALS that have finished, and what is read from the latter.
// tools/fleet_trial --overhead runs it.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "store/database.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {
namespace {

constexpr int kRepeats = 7;
constexpr int kClaims = 200;

template <class Work>
double milliseconds_of(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// The slowest of several, the first included, whose pages are not in memory yet.
template <class Work>
double slowest(const Work& work) {
  double longest = 0.0;
  for (int k = 0; k < kRepeats; ++k) longest = std::max(longest, milliseconds_of(work));
  return longest;
}

std::vector<Trial> numbered(int count) {
  std::vector<Trial> trials;
  trials.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    trials.push_back(
        {.key = fmt::format("new {}", i), .group = "specimens", .device = "new", .priority = 1.0});
  return trials;
}

/// Trials that have finished, a hundred for each device, with values in no order.
void fill(const StoreAddress& address, std::int64_t study, std::int64_t count) {
  const auto database = open_database(address);
  const bool is_postgresql = address.kind == StoreAddress::Kind::postgresql;
  const std::string numbers =
      is_postgresql ? fmt::format("SELECT generate_series(0, {}) AS n", count - 1)
                    : fmt::format(
                          "WITH RECURSIVE numbers(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM "
                          "numbers WHERE n < {}) SELECT n FROM numbers",
                          count - 1);
  const std::int64_t devices = std::max<std::int64_t>(1, count / 100);
  database->run_script(fmt::format(
      "INSERT INTO trials(study, key, spec, family, device, step, priority, state, attempt) "
      "SELECT {0}, 'trial ' || n, '{{}}', 'specimens', 'joint ' || (n % {1}), 0, 1.0, 2, 1 FROM "
      "({2}) AS list;"
      "INSERT INTO results SELECT id, study, 1, (id * 7919 % 1000003) / 1000003.0, '{{\"rows\": "
      "[]}}', 0.5, 0.0 FROM trials WHERE study = {0} AND state = 2;"
      "UPDATE studies SET trials = trials + {3}, total_priority = total_priority + {3} WHERE id = "
      "{0};{4}",
      study, devices, numbers, count, is_postgresql ? "ANALYZE" : ""));
}

/// Claim, finish and the question whether a halving step is complete, as a worker does for each trial.
double milliseconds_per_trial(StudyStore& store, std::int64_t study) {
  const double all = milliseconds_of([&] {
    for (int k = 0; k < kClaims; ++k) {
      const auto claim = store.claim(study, "worker", 60.0);
      store.finish(*claim, {.value = 1.0 / (k + 1), .result = std::string(300, ' ')});
      store.advance(study, [](const std::string&, int, std::span<const TrialRecord>) {
        return HalvingDecision{};
      });
    }
  });
  return all / kClaims;
}

void run(const std::string& place, std::int64_t count) {
  const StoreAddress address = store_address(place);
  StudyStore store(address);
  const StoredStudy small =
      store.create_or_resume({.name = "small", .kind = "test", .spec = "{}", .torsio_version = "1"},
                             numbered(2 * kClaims));
  const StoredStudy large =
      store.create_or_resume({.name = "large", .kind = "test", .spec = "{}", .torsio_version = "1"},
                             numbered(2 * kClaims));
  const double per_trial = milliseconds_per_trial(store, small.id);
  fill(address, large.id, count);
  const auto page_after = [&](double value) {
    TrialRecord last;
    last.result.value = value;
    (void)store.best(large.id, 50, &last);
  };
  fmt::print("{{\"trial_ms\": {:.3f}, ", per_trial);
  fmt::print("\"best_ms\": {:.3f}, ", slowest([&] { (void)store.best(large.id, 1); }));
  fmt::print("\"first_page_ms\": {:.3f}, ", slowest([&] { (void)store.best(large.id, 50); }));
  fmt::print("\"middle_page_ms\": {:.3f}, ", slowest([&] { page_after(0.5); }));
  fmt::print("\"history_ms\": {:.3f}, ", slowest([&] { (void)store.history("joint 7"); }));
  fmt::print("\"counts_ms\": {:.3f}, ", slowest([&] { (void)store.counts(large.id); }));
  fmt::print("\"trial_in_large_ms\": {:.3f}}}\n", milliseconds_per_trial(store, large.id));
}

}  // namespace
}  // namespace torsio

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "store_times STORE TRIALS\n");
    return 2;
  }
  try {
    torsio::run(argv[1], std::atoll(argv[2]));
  } catch (const std::exception& error) {
    fmt::print(stderr, "store_times: {}\n", error.what());
    return 1;
  }
  return 0;
}
