#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/grey_box/grey_box.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// One grey box for many joints: what a `GreyBox` of its own would estimate for each joint, to the bit. Each
/// term is evaluated for a group of joints; the states of one term lie side by side.
///
/// Floor: a step reads and writes each state once, so a box of 12 states needs 200 bytes per joint.
class GreyBoxRows {
 public:
  /// Whether the coefficients are not scheduled and there is no residual.
  [[nodiscard]] static bool supports(const GreyBox::Parameters& parameters) noexcept;

  /// @param model one for which `supports` holds
  GreyBoxRows(const GreyBox& model, std::size_t rows);

  /// @param features rows x inputs
  void step(std::span<const double> features) noexcept TORSIO_REALTIME;
  /// The estimate of the last `step`.
  [[nodiscard]] Estimate estimate(std::size_t row) const noexcept { return {.value = value_[row]}; }

  /// From the bytes of a model's state. @returns false, without effect, before the model's first step.
  [[nodiscard]] bool read(std::size_t row,
                          std::span<const std::byte> bytes) noexcept TORSIO_REALTIME;
  void write(std::size_t row, std::span<std::byte> bytes) noexcept TORSIO_REALTIME;

 private:
  static constexpr std::size_t kGroup = 64;  ///< joints
  using Block = std::array<double, kGroup>;

  /// Where each joint of a group lies between knots; see `HatCell`.
  struct Cells {
    std::array<std::int32_t, kGroup> left{};
    Block share{};
  };
  /// Slip elements and relaxations over one input.
  struct Motion {
    std::size_t input = 0;
    double period_s = 0.0;  ///< sample period, if the slip elements follow the integral; else 0
    std::vector<double> stiffness = {};  ///< 1 / r_i
    std::vector<double> decay = {};
    std::vector<double> gain = {};
    std::size_t first_state = 0;  ///< column of its last input; then s_i / r_i, then v_j
  };
  /// What the inputs did in this tick.
  struct Moves {
    Block travel;     ///< the increment of the coordinate of the slip elements
    Block increment;  ///< the increment of the input
    std::array<std::uint8_t, kGroup> is_usable;
  };

  void add_motion(std::size_t input, double period_s, std::span<const double> thresholds,
                  std::span<const double> time_constants_s);
  [[nodiscard]] Block* group_states(std::size_t group) noexcept {
    return states_.data() + group * state_columns_;
  }
  static void find_cells(std::span<const double> knots, bool is_held, const Block& x,
                         Cells& cells) noexcept;
  void step_group(Block* states, Block& value) noexcept;
  void find_moves(const Motion& motion, Block* states, Moves& moves) const noexcept;
  void add_slips(const Motion& motion, std::span<const double> knots, std::size_t first_column,
                 const Moves& moves, Block* states, Block& value) noexcept;
  void add_relaxations(const Motion& motion, std::size_t first_column, const Moves& moves,
                       Block* states, Block& value) const noexcept;
  void add_curve(const InputBank& bank, std::size_t first_column, Block& value) noexcept;
  void add_product(const InputBank& bank, std::size_t first_column, Block& value) noexcept;
  void add_rates(Block& value) const noexcept;

  GreyBoxTerms terms_;  ///< takes up the state of a row
  std::vector<double> coefficients_;
  std::vector<Motion> motions_;  ///< the motion of x, then one for each bank
  std::size_t state_columns_ = 0;
  detail::AlignedVector<Block> states_;  ///< groups x columns
  std::vector<double> row_state_;   ///< the state of one row, in the order of `GreyBoxTerms::state`
  std::vector<double> row_inputs_;  ///< last inputs of one row, one for each motion
  std::vector<Block> inputs_;       ///< the features of the group
  Cells cells_;
  std::vector<double> value_;
};

}  // namespace torsio
