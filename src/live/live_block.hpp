#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace torsio {

/// The samples of one joint that were not sent yet.
class LiveBlock {
 public:
  /// @param longest samples; from then on the block begins again with the newest
  LiveBlock(std::size_t channels, std::size_t longest) : channels_(channels), longest_(longest) {}

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// Samples between the last one and this are NaN; one that is not after the last is ignored.
  void add(std::uint64_t number, std::span<const double> values);
  /// Writes the block and empties it, all with the low byte first: u16 joint, u16 channels, u32 samples, f64 number of the first
  /// sample, f32 values, one channel after the other (web/src/live_messages.ts reads it).
  void append_to(std::vector<std::uint8_t>& message, std::uint16_t joint);
  /// Leaves the samples out.
  void clear() noexcept {
    count_ = 0;
    rows_.clear();
  }

 private:
  std::size_t channels_;
  std::size_t longest_;
  std::uint64_t first_ = 0;
  std::uint64_t next_ = 0;
  std::size_t count_ = 0;
  std::vector<float> rows_ = {};
};

}  // namespace torsio
