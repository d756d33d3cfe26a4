// store_times STORE ROWS: how long a store takes. Prints one line of JSON, in milliseconds: a trial's claim, finish and
// question for halving steps in a small study and in one of ROWS trials that have finished; what is read from the latter;
// and what is read about one device from a registry of ROWS rows. tools/fleet_trial --times runs it.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "store/database.hpp"
#include "torsio/store/registry.hpp"
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

/// A SELECT of n from 0 to count - 1.
std::string numbers(const StoreAddress& address, std::int64_t count) {
  if (address.kind == StoreAddress::Kind::postgresql)
    return fmt::format("SELECT generate_series(0, {}) AS n", count - 1);
  return fmt::format(
      "WITH RECURSIVE numbers(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM numbers WHERE n < {}) "
      "SELECT n FROM numbers",
      count - 1);
}

std::string_view analysis(const StoreAddress& address) {
  return address.kind == StoreAddress::Kind::postgresql ? "ANALYZE" : "";
}

/// Trials that have finished, a hundred for each device, with values in no order.
void fill_study(const StoreAddress& address, std::int64_t study, std::int64_t count) {
  const std::int64_t devices = std::max<std::int64_t>(1, count / 100);
  open_database(address)->run_script(fmt::format(
      "INSERT INTO trials(study, key, spec, family, device, step, priority, state, attempt) "
      "SELECT {0}, 'trial ' || n, '{{}}', 'specimens', 'joint ' || (n % {1}), 0, 1.0, 2, 1 FROM "
      "({2}) AS list;"
      "INSERT INTO results SELECT id, study, 1, (id * 7919 % 1000003) / 1000003.0, '{{\"rows\": "
      "[]}}', 0.5, 0.0 FROM trials WHERE study = {0} AND state = 2;"
      "UPDATE studies SET trials = trials + {3}, total_priority = total_priority + {3} WHERE id = "
      "{0};{4}",
      study, devices, numbers(address, count), count, analysis(address)));
}

/// About `count` rows: for each device 10 models, each promoted once and made from 2 of 20 recordings, and 38
/// comparisons. The rows of a device are far apart, as they are when it is calibrated again each month.
void fill_registry(const StoreAddress& address, std::int64_t count) {
  const std::int64_t devices = std::max<std::int64_t>(8, count / 100);
  const bool is_postgresql = address.kind == StoreAddress::Kind::postgresql;
  const std::string_view bytes =
      is_postgresql ? "decode(repeat('00', 2000), 'hex')" : "zeroblob(2000)";
  const auto list = [&](std::int64_t rows) { return numbers(address, rows); };
  open_database(address)->run_script(fmt::format(
      "INSERT INTO devices SELECT 'joint ' || n, 'dfki-50', '', 0.0 FROM ({devices}) AS list;"
      "INSERT INTO recordings SELECT 'joint ' || (n % {count}) || ' recording ' || (n / {count}), "
      "'joint ' || (n % {count}), '/data/' || n || '.csv', 20000, 1000.0, 0.0 FROM ({recordings}) "
      "AS list;"
      "INSERT INTO models(device, sha256, family, file, torsio_version, options, seed, metrics, "
      "added_at, added_by, note, size, bytes) SELECT 'joint ' || (n % {count}), 'model ' || n, "
      "'grey_box', 'joint.safetensors', '1', '{{}}', '1', '{{\"rmse\": 0.1}}', 0.0, 'robot@bench', "
      "'', 2000, {bytes} FROM ({models}) AS list;"
      "INSERT INTO model_recordings SELECT id, device || ' recording ' || (id % 20), 'train' FROM "
      "models;"
      "INSERT INTO model_recordings SELECT id, device || ' recording ' || ((id + 7) % 20), 'test' "
      "FROM models;"
      "INSERT INTO promotions(device, model, action, made_at, made_by, reason, request) SELECT "
      "device, id, 'promote', 0.0, 'robot@bench', 'calibrated', 'request ' || id FROM models ORDER "
      "BY id;"
      "INSERT INTO current_models SELECT device, max(id), 0.0 FROM models GROUP BY device;"
      "INSERT INTO drift(device, model, recording, found_at, verdict, rmse, details, request) "
      "SELECT c.device, c.model, c.device || ' recording ' || (n % 20), 0.0, 'not changed', 0.1, "
      "'{{}}', c.device || ' ' || n FROM ({comparisons}) AS list CROSS JOIN current_models c ORDER "
      "BY n;{analysis}",
      fmt::arg("count", devices), fmt::arg("devices", list(devices)),
      fmt::arg("recordings", list(20 * devices)), fmt::arg("models", list(10 * devices)),
      fmt::arg("comparisons", list(38)), fmt::arg("bytes", bytes),
      fmt::arg("analysis", analysis(address))));
}

std::int64_t rows_of_registry(const StoreAddress& address) {
  const auto database = open_database(address);
  std::int64_t rows = 0;
  for (const char* table : {"devices", "recordings", "models", "model_recordings", "promotions",
                            "current_models", "drift"})
    rows += std::get<std::int64_t>(
        database->run(fmt::format("SELECT count(*) FROM {}", table)).front().front());
  return rows;
}

/// All that `torsio store show` reads about a device.
void read_device(Registry& registry, const std::string& serial) {
  (void)registry.device(serial);
  (void)registry.models(serial);
  (void)registry.recordings(serial);
  (void)registry.promotions(serial);
  (void)registry.drift_history(serial);
  (void)registry.lineage(registry.current(serial)->id);
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

using Times = nlohmann::ordered_json;

Times times_of_studies(const StoreAddress& address, std::int64_t count) {
  StudyStore store(address);
  const StoredStudy small =
      store.create_or_resume({.name = "small", .kind = "test", .spec = "{}", .torsio_version = "1"},
                             numbered(2 * kClaims));
  const StoredStudy large =
      store.create_or_resume({.name = "large", .kind = "test", .spec = "{}", .torsio_version = "1"},
                             numbered(2 * kClaims));
  Times times;
  times["trial_ms"] = milliseconds_per_trial(store, small.id);
  fill_study(address, large.id, count);
  const auto page_after = [&](double value) {
    TrialRecord last;
    last.result.value = value;
    (void)store.best(large.id, 50, &last);
  };
  times["best_ms"] = slowest([&] { (void)store.best(large.id, 1); });
  times["first_page_ms"] = slowest([&] { (void)store.best(large.id, 50); });
  times["middle_page_ms"] = slowest([&] { page_after(0.5); });
  times["history_ms"] = slowest([&] { (void)store.history("joint 7"); });
  times["counts_ms"] = slowest([&] { (void)store.counts(large.id); });
  times["trial_in_large_ms"] = milliseconds_per_trial(store, large.id);
  return times;
}

Times times_of_registry(const StoreAddress& address, std::int64_t count) {
  Registry registry(address);
  fill_registry(address, count);
  Times times;
  times["registry_rows"] = rows_of_registry(address);
  times["drift_ms"] = slowest([&] { (void)registry.drift_history("joint 7"); });
  times["device_ms"] = slowest([&] { read_device(registry, "joint 5"); });
  return times;
}

}  // namespace
}  // namespace torsio

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "store_times STORE ROWS\n");
    return 2;
  }
  try {
    const torsio::StoreAddress address = torsio::store_address(argv[1]);
    const std::int64_t rows = std::atoll(argv[2]);
    torsio::Times times = torsio::times_of_studies(address, rows);
    times.update(torsio::times_of_registry(address, rows));
    fmt::print("{}\n", times.dump());
  } catch (const std::exception& error) {
    fmt::print(stderr, "store_times: {}\n", error.what());
    return 1;
  }
  return 0;
}
