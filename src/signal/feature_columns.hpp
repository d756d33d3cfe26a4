#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/aligned_vector.hpp"
#include "signal/expression_graph.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio::detail {

/// The features of many joints in one tick each: what a `FeaturePipeline` of its own would give each
/// joint, to the bit, once its filters have settled. Each operation is evaluated for a block of joints;
/// the states of one filter lie side by side. Arithmetic, `rate` and `lowpass` only.
class FeatureColumns {
 public:
  static constexpr std::size_t kBlock = 64;  ///< joints

  /// @throws Error as `FeaturePipeline`
  FeatureColumns(const FeatureSpec& spec, double sample_rate_Hz, std::size_t rows);

  /// Whether the pipeline has no other operation with a memory.
  [[nodiscard]] bool is_supported() const noexcept { return is_supported_; }
  [[nodiscard]] std::size_t feature_count() const noexcept { return sources_.size(); }
  void set_zero(std::size_t channel, double value) noexcept { zeros_[channel] = value; }

  /// The filters of a row from or into the bytes that `FeaturePipeline::visit_state` writes. `read` returns
  /// false, without effect, for a row whose filters have not started; `write` leaves the rest as it is.
  [[nodiscard]] bool read(std::size_t row,
                          std::span<const std::byte> state) noexcept TORSIO_REALTIME;
  void write(std::size_t row, std::span<std::byte> state) const noexcept TORSIO_REALTIME;

  /// The features of the rows `first` to `first + count` without a change of the filters; see `commit`.
  /// @param raw of these rows, one after the other @param count at most `kBlock`
  void step(std::size_t first, std::size_t count, const double* raw) noexcept TORSIO_REALTIME;
  /// A feature of the last `step`, one value per row.
  [[nodiscard]] const double* feature(std::size_t index) const noexcept {
    return values_[sources_[index]].data();
  }
  /// Whether a filter overflowed in the last `step`.
  [[nodiscard]] bool has_overflowed(std::size_t in_block) const noexcept {
    return overflowed_[in_block] != 0;
  }
  /// The filters of the rows whose flag is not 0 move on to what the last `step` found.
  void commit(std::size_t first, std::size_t count,
              const std::uint8_t* flags) noexcept TORSIO_REALTIME;

 private:
  using Block = std::array<double, kBlock>;
  struct Instruction {
    Operation operation;
    std::uint32_t target;
    std::uint32_t left;
    std::uint32_t right;
    std::size_t column;  ///< the first state of a filter
    double band_gain = 0.0;
    double low_gain = 0.0;
    double high_gain = 0.0;
  };

  void run(const Instruction& instruction, std::size_t first, std::size_t count) noexcept;
  [[nodiscard]] double* column(std::size_t index) noexcept {
    return states_.data() + index * rows_;
  }

  double sample_rate_Hz_;
  std::size_t rows_;
  bool is_supported_ = true;
  std::vector<double> zeros_;
  std::vector<std::uint32_t> raw_targets_;
  std::vector<std::uint32_t> sources_;
  std::vector<Instruction> instructions_;
  std::vector<std::size_t> differences_;  ///< first column of each: input and rate
  std::vector<std::size_t> lowpasses_;    ///< first column of each: band and low
  std::vector<Block> values_;             ///< one block for each node
  std::vector<Block> next_;               ///< one block for each column
  AlignedVector<double> states_;          ///< columns x rows
  std::array<std::uint8_t, kBlock> overflowed_{};
};

}  // namespace torsio::detail
