#include "model/grey_box/grey_box_rows.hpp"

#include <algorithm>
#include <cmath>

#include "core/hyperbolic_tangent.hpp"

namespace torsio {

bool GreyBoxRows::supports(const GreyBox::Parameters& parameters) noexcept {
  return !parameters.coefficients.scheduled && !parameters.residual;
}

GreyBoxRows::GreyBoxRows(const GreyBox& model, std::size_t rows)
    : terms_(model.parameters().terms), value_(rows) {
  const CoefficientSchedule& schedule = model.parameters().coefficients;
  coefficients_.assign(schedule.values.row(0).begin(), schedule.values.row(0).end());
  const GreyBoxTerms::Structure& structure = terms_.structure();
  add_motion(0, 0.0, structure.thresholds, structure.time_constants_s);
  for (const InputBank& bank : structure.banks)
    add_motion(bank.input, bank.is_integrated ? structure.sample_period_s : 0.0, bank.thresholds,
               bank.time_constants_s);
  states_.resize((rows + kGroup - 1) / kGroup * state_columns_);
  row_state_.resize(terms_.state().size());
  row_inputs_.resize(motions_.size());
  inputs_.resize(structure.inputs());
}

void GreyBoxRows::add_motion(std::size_t input, double period_s, std::span<const double> thresholds,
                             std::span<const double> time_constants_s) {
  Motion motion{.input = input, .period_s = period_s, .first_state = state_columns_};
  const SlipBank slips = detail::relative_stops(thresholds, GreyBox::kFamily);
  motion.stiffness.assign(slips.stiffness().begin(), slips.stiffness().end());
  detail::add_relaxations(time_constants_s, terms_.structure().sample_period_s, motion.decay,
                          motion.gain);
  state_columns_ += 1 + motion.stiffness.size() + motion.decay.size();
  motions_.push_back(std::move(motion));
}

bool GreyBoxRows::read(std::size_t row, std::span<const std::byte> bytes) noexcept {
  detail::StateBytes from(detail::StateBytes::Task::read, bytes);
  terms_.visit_state(from);
  if (!terms_.is_started()) return false;
  Block* const states = group_states(row / kGroup);
  const std::size_t n = row % kGroup;
  terms_.get_last(row_inputs_);
  auto state = terms_.state().begin();
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    const Motion& motion = motions_[m];
    Block* column = states + motion.first_state;
    (*column)[n] = row_inputs_[m];
    for (std::size_t i = 0; i < motion.stiffness.size() + motion.decay.size(); ++i)
      (*++column)[n] = *state++;
  }
  return true;
}

void GreyBoxRows::write(std::size_t row, std::span<std::byte> bytes) noexcept {
  const Block* const states = group_states(row / kGroup);
  const std::size_t n = row % kGroup;
  auto state = row_state_.begin();
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    const Motion& motion = motions_[m];
    const Block* column = states + motion.first_state;
    row_inputs_[m] = (*column)[n];
    for (std::size_t i = 0; i < motion.stiffness.size() + motion.decay.size(); ++i)
      *state++ = (*++column)[n];
  }
  terms_.set_state(row_state_);
  terms_.set_last(row_inputs_);
  detail::StateBytes to(bytes);
  terms_.visit_state(to);
}

void GreyBoxRows::step(std::span<const double> features) noexcept {
  const std::size_t inputs = inputs_.size();
  const std::size_t rows = value_.size();
  Block value;
  for (std::size_t first = 0; first < rows; first += kGroup) {
    const std::size_t count = std::min(kGroup, rows - first);
    const double* const from = features.data() + first * inputs;
    for (std::size_t i = 0; i < inputs; ++i)
      for (std::size_t n = 0; n < count; ++n) inputs_[i][n] = from[n * inputs + i];
    step_group(group_states(first / kGroup), value);
    std::copy_n(value.begin(), count, value_.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

// The terms in the order of `GreyBoxTerms::visit`, so that the sums round the same way.
void GreyBoxRows::step_group(Block* states, Block& value) noexcept {
  const GreyBoxTerms::Structure& structure = terms_.structure();
  Moves moves;
  find_moves(motions_[0], states, moves);
  find_cells(structure.curve_knots, false, inputs_[0], cells_);
  for (std::size_t n = 0; n < kGroup; ++n) {
    const double* const at = coefficients_.data() + cells_.left[n];
    value[n] = 0.0 + at[0] * (1.0 - cells_.share[n]);  // not -0
    value[n] += at[1] * cells_.share[n];
  }
  add_slips(motions_[0], structure.friction_knots, structure.first_slip(), moves, states, value);
  add_relaxations(motions_[0], structure.first_relaxation(), moves, states, value);
  std::size_t column = structure.first_bank();
  for (std::size_t k = 0; k < structure.banks.size(); ++k) {
    const InputBank& bank = structure.banks[k];
    const Motion& motion = motions_[k + 1];
    find_moves(motion, states, moves);
    add_slips(motion, bank.force_knots, column, moves, states, value);
    add_curve(bank, column + bank.first_curve(), value);
    add_product(bank, column + bank.first_product(), value);
    add_relaxations(motion, column + bank.first_relaxation(), moves, states, value);
    column += bank.columns();
  }
  add_rates(value);
}

void GreyBoxRows::find_moves(const Motion& motion, Block* states, Moves& moves) const noexcept {
  const Block& now = inputs_[motion.input];
  Block& last = states[motion.first_state];
  const bool is_bank = motion.input > 0;  // such a one passes over what is not finite
  for (std::size_t n = 0; n < kGroup; ++n) {
    const bool is_usable = !is_bank || std::isfinite(now[n]);
    moves.is_usable[n] = static_cast<std::uint8_t>(is_usable);
    moves.increment[n] = is_usable ? now[n] - last[n] : 0.0;
    last[n] = is_usable ? now[n] : last[n];
  }
  for (std::size_t n = 0; n < kGroup; ++n) {
    const double travel = motion.period_s > 0.0 && moves.is_usable[n] != 0
                              ? motion.period_s * now[n]
                              : moves.increment[n];
    moves.travel[n] = SlipBank::finite(travel);
  }
}

void GreyBoxRows::add_slips(const Motion& motion, std::span<const double> knots,
                            std::size_t first_column, const Moves& moves, Block* states,
                            Block& value) noexcept {
  const std::size_t slips = motion.stiffness.size();
  if (slips > 0 && knots.size() > 1) find_cells(knots, true, inputs_[0], cells_);
  for (std::size_t i = 0; i < slips; ++i) {
    const double stiffness = motion.stiffness[i];
    const double* const column = coefficients_.data() + first_column + i * knots.size();
    Block& slip = states[motion.first_state + 1 + i];
    for (std::size_t n = 0; n < kGroup; ++n) {
      const double force = slip[n] + stiffness * moves.travel[n];
      const double above = force < -1.0 ? -1.0 : force;
      slip[n] = above > 1.0 ? 1.0 : above;
    }
    if (knots.size() == 1) {
      for (std::size_t n = 0; n < kGroup; ++n) value[n] += column[0] * slip[n];
    } else if (knots.size() == 2) {
      for (std::size_t n = 0; n < kGroup; ++n)
        value[n] += (column[0] * (1.0 - cells_.share[n]) + column[1] * cells_.share[n]) * slip[n];
    } else {
      for (std::size_t n = 0; n < kGroup; ++n) {
        const double* const at = column + cells_.left[n];
        value[n] += (at[0] * (1.0 - cells_.share[n]) + at[1] * cells_.share[n]) * slip[n];
      }
    }
  }
}

void GreyBoxRows::add_relaxations(const Motion& motion, std::size_t first_column,
                                  const Moves& moves, Block* states, Block& value) const noexcept {
  Block* const first = states + motion.first_state + 1 + motion.stiffness.size();
  for (std::size_t j = 0; j < motion.decay.size(); ++j) {
    const double coefficient = coefficients_[first_column + j];
    const double decay = motion.decay[j];
    const double gain = motion.gain[j];
    Block& relaxation = first[j];
    for (std::size_t n = 0; n < kGroup; ++n) {
      const double moved = decay * relaxation[n] + gain * moves.increment[n];
      relaxation[n] = moves.is_usable[n] != 0 ? moved : relaxation[n];
      value[n] += coefficient * relaxation[n];
    }
  }
}

// The outer hats have no column: they are 0.
void GreyBoxRows::add_curve(const InputBank& bank, std::size_t first_column,
                            Block& value) noexcept {
  const std::vector<double>& knots = bank.curve_knots;
  if (knots.empty()) return;
  const Block& u = inputs_[bank.input];
  find_cells(knots, false, u, cells_);
  const double* const column = coefficients_.data() + first_column;
  for (std::size_t n = 0; n < kGroup; ++n) {
    if (!(u[n] >= knots.front() && u[n] <= knots.back())) continue;
    const auto left = static_cast<std::size_t>(cells_.left[n]);
    if (left > 0) value[n] += column[left - 1] * (1.0 - cells_.share[n]);
    if (left + 2 < knots.size()) value[n] += column[left] * cells_.share[n];
  }
}

void GreyBoxRows::add_product(const InputBank& bank, std::size_t first_column,
                              Block& value) noexcept {
  if (bank.product_knots.empty()) return;
  const Block& u = inputs_[bank.input];
  find_cells(bank.product_knots, true, inputs_[bank.product_input], cells_);
  for (std::size_t n = 0; n < kGroup; ++n) {
    const double* const at = coefficients_.data() + first_column + cells_.left[n];
    value[n] += at[0] * ((1.0 - cells_.share[n]) * u[n]);
    value[n] += at[1] * (cells_.share[n] * u[n]);
  }
}

void GreyBoxRows::add_rates(Block& value) const noexcept {
  const GreyBoxTerms::Structure& structure = terms_.structure();
  for (std::size_t j = 1; j < inputs_.size(); ++j) {
    const Block& u = inputs_[j];
    const double slope = coefficients_[structure.first_slope() + j];
    for (std::size_t n = 0; n < kGroup; ++n) value[n] += slope * u[n];
    const double factor = terms_.rate_factors()[j];
    if (!(factor > 0.0)) continue;
    const double friction = coefficients_[structure.first_coulomb() + j];
    for (std::size_t n = 0; n < kGroup; ++n)
      value[n] += friction * detail::hyperbolic_tangent(u[n] * factor);
  }
}

// The number of inner knots that are not above x, without a branch for each joint.
void GreyBoxRows::find_cells(std::span<const double> knots, bool is_held, const Block& x,
                             Cells& cells) noexcept {
  Block left{};  // as wide as x, so that whole vectors are compared and added
  for (const double knot : knots.subspan(1, knots.size() - 2))
    for (std::size_t n = 0; n < kGroup; ++n) left[n] += x[n] >= knot ? 1.0 : 0.0;
  for (std::size_t n = 0; n < kGroup; ++n) {
    cells.left[n] = static_cast<std::int32_t>(left[n]);
    const double* const at = knots.data() + cells.left[n];
    cells.share[n] = (x[n] - at[0]) / (at[1] - at[0]);
  }
  if (!is_held) return;
  for (double& share : cells.share) share = std::min(std::max(share, 0.0), 1.0);
}

}  // namespace torsio
