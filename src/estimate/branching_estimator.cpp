#include "estimate/branching_estimator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"

namespace torsio {
namespace {

// The places of a record; the bytes of the states A and B follow.
constexpr std::size_t kHasBefore = 0;  ///< 1 if A is a state, 0 if it is that after a reset
constexpr std::size_t kHasAfter =
    1;  ///< 1 if B is a state, 0 if no tick was evaluated since the commit
constexpr std::size_t kTime = 2;    ///< [s] of the tick
constexpr std::size_t kMissed = 3;  ///< ticks that did not take place before it
constexpr std::size_t kValue = 4;
constexpr std::size_t kStdDev = 5;
constexpr std::size_t kNovelty = 6;
constexpr std::size_t kFault = 7;
constexpr std::size_t kPlaces = 8;

/// Two times of a simulator that differ by less than this share of the period are the same.
constexpr double kSameTime = 1e-6;
/// So many ticks after one that was not committed the state is that of another time.
constexpr double kLate = 1.5;

std::size_t numbers_of(std::size_t bytes) noexcept {
  return (bytes + sizeof(double) - 1) / sizeof(double);
}

std::span<std::byte> state_before(std::span<double> record, std::size_t bytes) noexcept {
  return std::as_writable_bytes(record.subspan(kPlaces)).first(bytes);
}
std::span<std::byte> state_after(std::span<double> record, std::size_t bytes) noexcept {
  return std::as_writable_bytes(record.subspan(kPlaces + numbers_of(bytes))).first(bytes);
}

void load(Estimator& estimator, double has_state, std::span<const std::byte> state) noexcept {
  if (has_state != 1.0 || !estimator.load(state)) estimator.reset();
}

void note(std::span<double> record, const Estimate& estimate) noexcept {
  record[kValue] = estimate.value;
  record[kStdDev] = estimate.std_dev;
  record[kNovelty] = estimate.novelty;
  record[kFault] = static_cast<double>(estimate.fault);
}

bool has_settled(Fault fault) noexcept {
  return fault != Fault::warming_up && fault != Fault::recovering;
}

}  // namespace

/// A copy of the estimator that this evaluation alone uses.
class BranchingEstimator::Lease {
 public:
  explicit Lease(std::span<const std::unique_ptr<Copy>> copies) noexcept {
    for (std::size_t i = 0;; i = (i + 1) % copies.size())
      if (!copies[i]->is_used.test_and_set(std::memory_order_acquire)) {
        copy_ = copies[i].get();
        return;
      }
  }
  ~Lease() { copy_->is_used.clear(std::memory_order_release); }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

  [[nodiscard]] Estimator& estimator() const noexcept { return copy_->estimator; }

 private:
  Copy* copy_ = nullptr;
};

BranchingEstimator::BranchingEstimator(const Estimator& estimator, double period_s,
                                       std::size_t copies)
    : period_s_(period_s), state_bytes_(estimator.state_size()) {
  if (state_bytes_ == 0)
    throw Error({.place = "estimator in a simulator",
                 .expected = "a model whose state can be saved",
                 .found = std::string(estimator.model().family()),
                 .advice = "A family of your own lists its state in visit_state."});
  if (estimator.raw_inputs().size() > kMaxInputs)
    throw Error({.place = "estimator in a simulator",
                 .expected = fmt::format("at most {} channels", kMaxInputs),
                 .found = std::to_string(estimator.raw_inputs().size())});
  for (std::size_t i = 0; i < std::max<std::size_t>(copies, 1); ++i)
    copies_.push_back(std::make_unique<Copy>(estimator));
}

std::size_t BranchingEstimator::record_size(std::size_t state_bytes) noexcept {
  return kPlaces + 2 * numbers_of(state_bytes);
}

double BranchingEstimator::value(std::span<double> record, double time_s,
                                 std::span<const double> raw) const noexcept {
  const Lease lease(copies_);
  Estimator& estimator = lease.estimator();
  const std::span<std::byte> before = state_before(record, state_bytes_);
  const std::span<std::byte> after = state_after(record, state_bytes_);
  const double share = record[kHasAfter] == 1.0 ? (time_s - record[kTime]) / period_s_ : 0.0;
  const auto from_before = [&] {
    load(estimator, record[kHasBefore], before);
    estimator.set_wrong_rate(false);
    if (record[kMissed] > 0.0) estimator.miss(record[kMissed]);
    return estimator.step(raw);
  };
  if (!(share > kSameTime)) {
    const Estimate estimate = from_before();
    (void)estimator.save(after);
    record[kHasAfter] = 1.0;
    record[kTime] = time_s;
    note(record, estimate);
    return estimate.value;
  }
  const bool is_late = share > kLate;
  load(estimator, 1.0, after);
  estimator.set_wrong_rate(is_late);
  const Estimate next = estimator.step(raw);
  if (next.fault == Fault::wrong_rate) record[kFault] = static_cast<double>(next.fault);
  if (share >= 1.0 - kSameTime) return next.value;
  return (1.0 - share) * from_before().value + share * next.value;
}

void BranchingEstimator::commit(std::span<double> record, double time_s) const noexcept {
  if (record[kHasAfter] != 1.0) return;
  const double ticks = std::floor((time_s - record[kTime]) / period_s_ + kSameTime);
  if (!(ticks >= 1.0)) return;
  std::ranges::copy(state_after(record, state_bytes_), state_before(record, state_bytes_).begin());
  record[kHasBefore] = 1.0;
  record[kHasAfter] = 0.0;
  record[kMissed] = ticks - 1.0;
}

Estimate BranchingEstimator::last(std::span<const double> record) noexcept {
  const double fault = record[kFault];
  return {.value = record[kValue],
          .std_dev = record[kStdDev],
          .novelty = record[kNovelty],
          .fault = fault >= 0.0 && fault < static_cast<double>(kFaultCount)
                       ? static_cast<Fault>(fault)
                       : Fault::model_not_finite};
}

void BranchingEstimator::settle(std::span<double> record, std::span<const double> raw,
                                double longest_s) const noexcept {
  const Lease lease(copies_);
  Estimator& estimator = lease.estimator();
  estimator.reset();
  estimator.set_wrong_rate(false);
  Estimate estimate;
  for (double time_s = 0.0; !(time_s > longest_s); time_s += period_s_) {
    estimate = estimator.step(raw);
    if (estimator.is_settled() && has_settled(estimate.fault)) break;
  }
  std::ranges::fill(record.first(kPlaces), 0.0);
  (void)estimator.save(state_before(record, state_bytes_));
  record[kHasBefore] = 1.0;
  note(record, estimate);
}

}  // namespace torsio
