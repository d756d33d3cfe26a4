#pragma once

#include <cstdint>
#include <optional>

namespace torsio {

/// The machine's time of the samples of one joint: its clock plus a difference that is the least one of those learned, as that
/// sample was the least delayed. The steps between samples are those of the joint's clock.
class WallTime {
 public:
  /// A sample that has arrived just now.
  void learn(std::uint64_t joint_ns, std::uint64_t wall_ns) noexcept {
    const auto difference_ns = static_cast<std::int64_t>(wall_ns - joint_ns);
    if (!difference_ns_ || difference_ns < *difference_ns_) difference_ns_ = difference_ns;
  }
  /// Microseconds since 1970, of a sample that has arrived just now or was learned. The difference is learned anew if the time
  /// would be more than 20 ms in the future or 0.5 s ago: the joint was started again, or one of the clocks was set.
  [[nodiscard]] std::uint64_t time_us(std::uint64_t joint_ns, std::uint64_t wall_ns) noexcept {
    const auto difference_ns = static_cast<std::int64_t>(wall_ns - joint_ns);
    const std::int64_t age_ns = difference_ns - difference_ns_.value_or(difference_ns);
    if (!difference_ns_ || age_ns < -kEarliest_ns || age_ns > kLatest_ns)
      difference_ns_ = difference_ns;
    return (joint_ns + static_cast<std::uint64_t>(*difference_ns_) + 500) / 1000;
  }

 private:
  static constexpr std::int64_t kEarliest_ns = 20'000'000;
  static constexpr std::int64_t kLatest_ns = 500'000'000;

  std::optional<std::int64_t> difference_ns_ = {};
};

}  // namespace torsio
