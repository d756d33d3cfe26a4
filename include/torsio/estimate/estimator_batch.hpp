#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// Many joints of one model, one per row, with separate states: every row gets the numbers of a single
/// `Estimator`, to the bit, for less time.
///
/// A row whose filters have settled, whose memory misses nothing and whose inputs are ordinary (finite, no
/// jump, inside the ranges of the training) takes the short way: features and guards of a block of rows at
/// once, LSTM and GRU networks with the weights read once for many rows. All other rows are stepped by one
/// estimator that takes up their states one after the other. Zeros are those of all rows.
///
/// The caller ensures that a row is below `size()` and that the spans of a step have the sizes below; a
/// build with assertions checks it. Bytes of a state may have any size and content.
class EstimatorBatch {
 public:
  /// @throws UsageError if there is no row; Error if the state of the model cannot be saved, or as `Estimator`
  EstimatorBatch(const EstimatorSettings& settings, const AnyModel& model, std::size_t rows);
  EstimatorBatch(EstimatorBatch&& other) noexcept;
  EstimatorBatch& operator=(EstimatorBatch&& other) noexcept;
  ~EstimatorBatch();

  [[nodiscard]] std::size_t size() const noexcept;  ///< rows
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept;
  /// As those of `Estimator`, for all rows.
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept;
  void set_zero(std::string_view channel, double value);

  /// @param raw size() x raw_inputs().size() numbers, row by row @param estimates size() of them
  void step(std::span<const double> raw, std::span<Estimate> estimates) noexcept TORSIO_REALTIME;

  void reset() noexcept;
  void reset(std::size_t row) noexcept TORSIO_REALTIME;

  /// The state of a row: the bytes of `Estimator`, which takes them and whose bytes are taken. `save` and
  /// `load` return false, without effect, for bytes of another size, `load` also for those of another model.
  [[nodiscard]] std::size_t state_size() const noexcept;
  [[nodiscard]] bool save(std::size_t row, std::span<std::byte> bytes) noexcept TORSIO_REALTIME;
  [[nodiscard]] bool is_state(std::span<const std::byte> bytes) noexcept TORSIO_REALTIME;
  [[nodiscard]] bool load(std::size_t row,
                          std::span<const std::byte> bytes) noexcept TORSIO_REALTIME;

 private:
  struct Rows;
  std::unique_ptr<Rows> rows_;
};

}  // namespace torsio
