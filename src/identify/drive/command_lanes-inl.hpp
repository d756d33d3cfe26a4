// The command of a drive and its delay in the lanes of drive_rollout.cpp; included once for each instruction set.

#if defined(TORSIO_IDENTIFY_COMMAND_LANES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TORSIO_IDENTIFY_COMMAND_LANES_INL_HPP
#undef TORSIO_IDENTIFY_COMMAND_LANES_INL_HPP
#else
#define TORSIO_IDENTIFY_COMMAND_LANES_INL_HPP
#endif

// clang-format off
#include <hwy/highway.h>
// clang-format on

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/aligned_vector.hpp"
#include "identify/drive/drive_rollout.hpp"

HWY_BEFORE_NAMESPACE();
namespace torsio::drive_rollout::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kDriveLanes>;
using V = hn::Vec<D>;
using Index = hn::RebindToSigned<D>;

HWY_INLINE V constant(double value) { return hn::Set(D(), value); }

// The command of a log, late by a delay in each lane: linear between its samples, except where it jumps, and constant
// before and after the log. Places are times in samples.
class LaneCommand {
 public:
  HWY_INLINE LaneCommand(const DriveLog& log, V delay_s)
      : log_(log),
        end_(log.command_end.empty() ? log.command.data() + 1 : log.command_end.data()),
        delay_s_(delay_s) {}

  HWY_INLINE void move_to(double now) {
    const V place = hn::NegMulAdd(delay_s_, constant(1.0 / log_.sample_period_s), constant(now));
    const V last = constant(static_cast<double>(log_.size() - 2));
    cell_ = hn::Min(hn::Max(hn::Floor(place), hn::Zero(D())), last);
    const auto index = hn::ConvertTo(Index(), cell_);
    left_ = hn::GatherIndex(D(), log_.command.data(), index);
    right_ = hn::GatherIndex(D(), end_, index);
    const V share = hn::Sub(place, cell_);
    within_cell_ = hn::Min(hn::Max(share, hn::Zero(D())), constant(1.0));
    outside_ = hn::Sub(share, within_cell_);
  }

  [[nodiscard]] HWY_INLINE V value() const {
    return hn::MulAdd(within_cell_, hn::Sub(right_, left_), left_);
  }

  // The integral from here to `now`, at most one sample later.
  HWY_INLINE V integral_to(double now) {
    const V cell = cell_;
    const V begun = integral();
    const V rest = hn::NegMulAdd(constant(-0.5), hn::Add(left_, right_), hn::Neg(begun));
    move_to(now);
    const V ended = integral();
    return hn::IfThenElse(hn::Eq(cell, cell_), hn::Sub(ended, begun), hn::Add(rest, ended));
  }

 private:
  // From the sample before.
  [[nodiscard]] HWY_INLINE V integral() const {
    const V mean = hn::MulAdd(hn::Mul(constant(0.5), within_cell_), hn::Sub(right_, left_), left_);
    const V edge = hn::IfThenElse(hn::Lt(outside_, hn::Zero(D())), left_, right_);
    return hn::MulAdd(within_cell_, mean, hn::Mul(outside_, edge));
  }

  const DriveLog& log_;
  const double* end_;
  V delay_s_;
  V cell_ = hn::Zero(D()), left_ = hn::Zero(D()), right_ = hn::Zero(D());
  V within_cell_ = hn::Zero(D()), outside_ = hn::Zero(D());
};

// The past values of the torque of a law.
class DelayRing {
 public:
  HWY_INLINE DelayRing(V delay_s, double longest_s, double step_s)
      : steps_(hn::Mul(delay_s, constant(1.0 / step_s))) {
    constexpr double kMaxSteps = 1e6;
    max_steps_ = std::floor(std::min(longest_s / step_s, kMaxSteps)) + 1.0;
    mask_ = std::bit_ceil(static_cast<std::size_t>(max_steps_) + 2) - 1;
  }

  // `wanted` as it was one delay ago, interpolated; before the first step as it is then.
  HWY_INLINE V delayed(V wanted) {
    const std::size_t width = hn::MaxLanes(D());
    if (ring_.empty()) {
      ring_.resize((mask_ + 1) * width);
      for (std::size_t k = 0; k <= mask_; ++k) hn::Store(wanted, D(), ring_.data() + k * width);
    }
    hn::Store(wanted, D(), ring_.data() + (newest_ & mask_) * width);
    const V steps = hn::Min(hn::Max(steps_, hn::Zero(D())), constant(max_steps_));
    const V whole = hn::Floor(steps);
    const V newest = constant(static_cast<double>(newest_ + mask_ + 1));
    const auto slot = [&](V past) HWY_ATTR {
      const Index tag;
      const auto ring = hn::And(hn::ConvertTo(tag, hn::Sub(newest, past)),
                                hn::Set(tag, static_cast<std::int64_t>(mask_)));
      return hn::Add(hn::Mul(ring, hn::Set(tag, static_cast<std::int64_t>(width))),
                     hn::Iota(tag, 0));
    };
    const V recent = hn::GatherIndex(D(), ring_.data(), slot(whole));
    const V older = hn::GatherIndex(D(), ring_.data(), slot(hn::Add(whole, constant(1.0))));
    ++newest_;
    return hn::MulAdd(hn::Sub(steps, whole), hn::Sub(older, recent), recent);
  }

 private:
  V steps_;
  double max_steps_ = 0.0;
  std::size_t mask_ = 0;
  std::size_t newest_ = 0;
  detail::AlignedVector<double> ring_;
};

}  // namespace torsio::drive_rollout::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
