#include "torsio/estimate/estimator_batch.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <limits>
#include <variant>

#include "model/grey_box/grey_box_rows.hpp"
#include "model/network/dense_stack.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "signal/feature_columns.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using detail::FeatureColumns;
using detail::StateBytes;

/// One recurrent network for all rows, in groups whose states remain in the nearest cache.
template <class Layer>
class NetworkRows {
 public:
  NetworkRows(const RecurrentParameters<Layer>& parameters, std::size_t rows)
      : warm_up_samples_(parameters.warm_up_samples) {
    for (const Layer& layer : parameters.layers) units_.push_back(layer.units());
    for (std::size_t first = 0; first < rows; first += kGroup)
      groups_.emplace_back(parameters, std::min(kGroup, rows - first), Layer::kFamily);
    state_.resize(groups_.front().state_size());
    estimates_.resize(rows);
  }

  void step(std::span<const double> features) noexcept {
    const std::size_t inputs = groups_.front().input_count();
    std::size_t first = 0;
    for (RecurrentNetwork<Layer>& group : groups_) {
      const std::size_t count = group.joint_count();
      group.step(features.subspan(first * inputs, count * inputs),
                 std::span(estimates_).subspan(first, count));
      first += count;
    }
  }
  [[nodiscard]] Estimate estimate(std::size_t row) const noexcept { return estimates_[row]; }

  /// From the bytes of the model's state. @returns false, without effect, while it warms up.
  [[nodiscard]] bool read(std::size_t row, std::span<const std::byte> bytes) noexcept {
    std::uint64_t steps = 0;
    std::memcpy(&steps, bytes.data() + bytes.size() - sizeof steps, sizeof steps);
    if (steps < warm_up_samples_) return false;
    float* state = state_.data();
    visit_parts([&](std::size_t units, std::size_t offset) {
      std::memcpy(state, bytes.data() + offset, units * sizeof(float));
      state += units;
    });
    groups_[row / kGroup].set_state(row % kGroup, state_);
    return true;
  }
  void write(std::size_t row, std::span<std::byte> bytes) noexcept {
    groups_[row / kGroup].get_state(row % kGroup, state_);
    const float* state = state_.data();
    visit_parts([&](std::size_t units, std::size_t offset) {
      std::memcpy(bytes.data() + offset, state, units * sizeof(float));
      state += units;
    });
  }

 private:
  static constexpr std::size_t kGroup = 128;

  /// The bytes contain h, then c, for each layer, padded to whole vectors.
  template <class Visit>
  void visit_parts(const Visit& visit) const noexcept {
    constexpr int kParts = std::same_as<Layer, LstmLayer> ? 2 : 1;
    std::size_t offset = 0;
    for (const std::size_t units : units_)
      for (int part = 0; part < kParts; ++part) {
        visit(units, offset);
        offset += padded_count(units) * sizeof(float);
      }
  }

  std::vector<RecurrentNetwork<Layer>> groups_;
  std::vector<std::size_t> units_;
  std::size_t warm_up_samples_;
  std::vector<float> state_;
  std::vector<Estimate> estimates_;
};

/// A model that is evaluated for all rows together; the first: none, the rows are evaluated one by one.
using ModelRows =
    std::variant<std::monostate, NetworkRows<LstmLayer>, NetworkRows<GruLayer>, GreyBoxRows>;

ModelRows model_rows_of(const AnyModel& model, std::size_t rows) {
  if (const auto* const lstm = model.get_if<Lstm>())
    return NetworkRows<LstmLayer>(lstm->parameters(), rows);
  if (const auto* const gru = model.get_if<Gru>())
    return NetworkRows<GruLayer>(gru->parameters(), rows);
  const auto* const box = model.get_if<GreyBox>();
  if (box != nullptr && GreyBoxRows::supports(box->parameters())) return GreyBoxRows(*box, rows);
  return {};
}

/// use(rows), if there are any; else `otherwise`. std::visit could throw.
template <class Use>
bool use_rows(ModelRows& rows, bool otherwise, const Use& use) noexcept {
  if (auto* const lstm = std::get_if<NetworkRows<LstmLayer>>(&rows)) return use(*lstm);
  if (auto* const gru = std::get_if<NetworkRows<GruLayer>>(&rows)) return use(*gru);
  if (auto* const box = std::get_if<GreyBoxRows>(&rows)) return use(*box);
  return otherwise;
}

/// The estimator that takes up the state of a row.
struct Worker {
  detail::EstimatorCore core;
  AnyModel model;

  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(core);
    detail::visit_state_of(model, bytes);
  }
};

std::size_t checked(std::size_t rows) {
  if (rows == 0) throw UsageError({.place = "batch", .expected = "at least one row", .found = "0"});
  return rows;
}

}  // namespace

struct EstimatorBatch::Rows {
  Rows(const EstimatorSettings& settings, const AnyModel& model, std::size_t rows);

  void step(std::span<const double> raw, std::span<Estimate> estimates) noexcept TORSIO_REALTIME;
  void reset(std::size_t row) noexcept TORSIO_REALTIME;
  /// The state of a row that is at rest goes from the columns into its bytes, and back.
  void leave_rest(std::size_t row) noexcept TORSIO_REALTIME;
  void find_rest(std::size_t row) noexcept TORSIO_REALTIME;
  /// The zero of an input has changed.
  void follow_zero() noexcept;

  [[nodiscard]] std::span<std::byte> state(std::size_t row) noexcept {
    return std::span(states).subspan(row * state_bytes, state_bytes);
  }
  template <class Object>
  static void read(Object& object, std::span<const std::byte> from) noexcept {
    StateBytes bytes(StateBytes::Task::read, from);
    object.visit_state(bytes);
  }
  template <class Object>
  static void write(Object& object, std::span<std::byte> to) noexcept {
    StateBytes bytes(to);
    object.visit_state(bytes);
  }

  /// Features of a block; for rows at rest with ordinary inputs, their filters, too.
  void find_ordinary(std::size_t first, std::size_t rows, const double* raw) noexcept;
  [[nodiscard]] Estimate ordinary_step(std::size_t row) noexcept;
  [[nodiscard]] Estimate unusable(std::size_t row, const Estimate& estimate) noexcept;
  [[nodiscard]] Estimate other_step(std::size_t row, std::span<const double> raw) noexcept;

  Worker worker;
  detail::EstimatorCore resting;  ///< guards of the rows at rest
  bool has_resting = false;
  std::uint64_t identity;
  std::size_t count;
  std::size_t channels;
  std::size_t inputs;
  std::size_t core_bytes = 0;
  std::size_t state_bytes = 0;
  detail::StateSegments model_state;  ///< members of `worker.model`
  std::vector<std::byte> start;       ///< the state after a reset
  std::vector<std::byte> states;      ///< rows x state_bytes
  FeatureColumns columns;
  ModelRows model_rows;
  std::vector<std::uint8_t> is_at_rest;
  std::vector<std::uint8_t> is_ordinary;
  std::vector<double> previous_raw;          ///< rows x channels, of rows at rest
  std::vector<double> previous_first;        ///< first feature, likewise
  std::vector<double> last_value;            ///< meaningful for rows at rest only
  std::vector<detail::StrokeClock> strokes;  ///< likewise
  std::vector<double> features;              ///< rows x inputs
};

EstimatorBatch::Rows::Rows(const EstimatorSettings& settings, const AnyModel& model,
                           std::size_t rows)
    : worker{detail::EstimatorCore(settings, model), model},
      resting(worker.core),
      identity(Estimator(settings, model).state_identity()),
      count(checked(rows)),
      channels(worker.core.raw_inputs().size()),
      inputs(model.input_count()),
      columns(settings.features, settings.sample_rate_Hz, rows),
      model_rows(model_rows_of(model, rows)),
      is_at_rest(rows, 0),
      is_ordinary(rows, 0),
      previous_raw(rows * channels),
      previous_first(rows),
      last_value(rows),
      strokes(rows, worker.core.strokes()),
      features(rows * inputs) {
  worker.core.reset();
  worker.model.reset();
  StateBytes of_core;
  of_core.visit(worker.core);
  core_bytes = of_core.position();
  StateBytes of_all;
  worker.visit_state(of_all);
  if (!of_all.is_valid())
    throw Error({.place = "batch", .problem = "the state of this model cannot be saved"});
  state_bytes = of_all.position();
  model_state = detail::StateSegments(
      [this](StateBytes& bytes) { detail::visit_state_of(worker.model, bytes); });
  start.resize(state_bytes);
  write(worker, start);
  states.resize(rows * state_bytes);
  for (std::size_t row = 0; row < rows; ++row) reset(row);
}

void EstimatorBatch::Rows::reset(std::size_t row) noexcept {
  std::ranges::copy(start, state(row).begin());
  is_at_rest[row] = 0;
}

void EstimatorBatch::Rows::leave_rest(std::size_t row) noexcept {
  if (is_at_rest[row] == 0) return;
  is_at_rest[row] = 0;
  columns.write(row, state(row));
  read(worker.core, state(row).first(core_bytes));
  worker.core.continue_after(previous_raw.data() + row * channels, previous_first[row],
                             last_value[row], strokes[row]);
  write(worker.core, state(row).first(core_bytes));
  use_rows(model_rows, false, [&](auto& together) {
    together.write(row, state(row).subspan(core_bytes));
    return true;
  });
}

void EstimatorBatch::Rows::find_rest(std::size_t row) noexcept {
  if (!columns.is_supported() || !worker.core.is_at_rest()) return;
  if (!columns.read(row, state(row))) return;
  const bool is_warm = use_rows(model_rows, true, [&](auto& together) {
    return together.read(row, state(row).subspan(core_bytes));
  });
  if (!is_warm) return;
  std::ranges::copy(worker.core.previous_raw(),
                    previous_raw.begin() + static_cast<std::ptrdiff_t>(row * channels));
  previous_first[row] = worker.core.previous_first();
  last_value[row] = worker.core.last_value();
  strokes[row] = worker.core.strokes();
  is_at_rest[row] = 1;
  if (!has_resting) read(resting, state(row).first(core_bytes));
  has_resting = true;
}

void EstimatorBatch::Rows::find_ordinary(std::size_t first, std::size_t rows,
                                         const double* raw) noexcept {
  std::uint8_t* const ordinary = is_ordinary.data() + first;
  std::copy_n(is_at_rest.data() + first, rows, ordinary);
  for (std::size_t i = 0; i < channels; ++i) {
    const double limit = worker.core.jump_limit(i);
    const double* const previous = previous_raw.data() + first * channels;
    for (std::size_t n = 0; n < rows; ++n) {
      const double now = raw[n * channels + i];
      const bool is_usable = std::abs(now) <= std::numeric_limits<double>::max() &&
                             !(std::abs(now - previous[n * channels + i]) > limit);
      ordinary[n] &= static_cast<std::uint8_t>(is_usable);
    }
  }
  columns.step(first, rows, raw);
  const bool has_strokes = worker.core.has_strokes();
  for (std::size_t i = 0; i < inputs; ++i) {
    const double* const feature = columns.feature(i);
    const double lowest = worker.core.lowest(i);
    const double highest = worker.core.highest(i);
    double* const to = features.data() + first * inputs + i;
    for (std::size_t n = 0; n < rows; ++n) {
      const bool is_inside = feature[n] >= lowest && feature[n] <= highest;  // not NaN
      ordinary[n] &= static_cast<std::uint8_t>(is_inside);
      to[n * inputs] = feature[n];
    }
  }
  for (std::size_t n = 0; n < rows; ++n) {
    if (columns.has_overflowed(n)) ordinary[n] = 0;
    if (ordinary[n] != 0) {
      std::copy_n(raw + n * channels, channels, previous_raw.data() + (first + n) * channels);
      previous_first[first + n] = features[(first + n) * inputs];
      if (has_strokes) strokes[first + n].follow(previous_first[first + n]);
    } else {
      leave_rest(first + n);
      std::fill_n(features.data() + (first + n) * inputs, inputs, 0.0);
    }
  }
  columns.commit(first, rows, ordinary);
}

Estimate EstimatorBatch::Rows::ordinary_step(std::size_t row) noexcept {
  Estimate estimate;
  const Features now = std::span<const double>(features).subspan(row * inputs, inputs);
  const bool is_together = use_rows(model_rows, false, [&](const auto& together) {
    estimate = together.estimate(row);
    return true;
  });
  if (!is_together) {
    const auto bytes = state(row).subspan(core_bytes);
    if (model_state.is_valid()) {
      model_state.read(bytes);
      estimate = worker.model.step(now);
      model_state.write(bytes);
    } else {
      StateBytes from(StateBytes::Task::read, bytes);
      detail::visit_state_of(worker.model, from);
      estimate = worker.model.step(now);
      StateBytes to(bytes);
      detail::visit_state_of(worker.model, to);
    }
  }
  if (estimate.fault != Fault::none || !std::isfinite(estimate.value))
    return unusable(row, estimate);
  if (resting.has_strokes()) resting.set_strokes(strokes[row]);
  const Estimate guarded = resting.apply_guards({.features = now, .for_model = now}, estimate);
  last_value[row] = guarded.value;
  return guarded;
}

// The rest of an `Estimator`'s step.
Estimate EstimatorBatch::Rows::unusable(std::size_t row, const Estimate& estimate) noexcept {
  const Features now = std::span<const double>(features).subspan(row * inputs, inputs);
  leave_rest(row);
  read(worker, state(row));
  const bool is_finite = std::isfinite(estimate.value);
  if (!is_finite) worker.model.reset();
  if (!is_finite || estimate.fault == Fault::model_not_finite) worker.core.lose_memory();
  const Estimate guarded = worker.core.apply_guards({.features = now, .for_model = now}, estimate);
  write(worker, state(row));
  find_rest(row);
  return guarded;
}

void EstimatorBatch::Rows::follow_zero() noexcept {
  for (std::size_t row = 0; row < count; ++row) {
    leave_rest(row);
    read(worker.core, state(row).first(core_bytes));
    worker.core.follow_zero();
    write(worker.core, state(row).first(core_bytes));
  }
}

Estimate EstimatorBatch::Rows::other_step(std::size_t row, std::span<const double> raw) noexcept {
  read(worker, state(row));
  const Estimate estimate = detail::estimator_step(worker.core, worker.model, raw);
  write(worker, state(row));
  find_rest(row);
  return estimate;
}

void EstimatorBatch::Rows::step(std::span<const double> raw,
                                std::span<Estimate> estimates) noexcept {
  for (std::size_t first = 0; first < count; first += FeatureColumns::kBlock)
    find_ordinary(first, std::min(FeatureColumns::kBlock, count - first),
                  raw.data() + first * channels);
  use_rows(model_rows, false, [&](auto& together) {
    together.step(features);
    return true;
  });
  for (std::size_t row = 0; row < count; ++row)
    estimates[row] = is_ordinary[row] != 0 ? ordinary_step(row)
                                           : other_step(row, raw.subspan(row * channels, channels));
}

EstimatorBatch::EstimatorBatch(const EstimatorSettings& settings, const AnyModel& model,
                               std::size_t rows)
    : rows_(std::make_unique<Rows>(settings, model, rows)) {}
EstimatorBatch::EstimatorBatch(EstimatorBatch&& other) noexcept = default;
EstimatorBatch& EstimatorBatch::operator=(EstimatorBatch&& other) noexcept = default;
EstimatorBatch::~EstimatorBatch() = default;

std::size_t EstimatorBatch::size() const noexcept { return rows_->count; }
const std::vector<std::string>& EstimatorBatch::raw_inputs() const noexcept {
  return rows_->worker.core.raw_inputs();
}
const std::vector<std::string>& EstimatorBatch::unset_zeros() const noexcept {
  return rows_->worker.core.unset_zeros();
}

void EstimatorBatch::set_zero(std::string_view channel, double value) {
  if (rows_->worker.core.set_zero(channel, value)) rows_->follow_zero();
  rows_->resting.set_zero(channel, value);
  const std::size_t index =
      static_cast<std::size_t>(std::ranges::find(raw_inputs(), channel) - raw_inputs().begin());
  rows_->columns.set_zero(index, value);
}

void EstimatorBatch::step(std::span<const double> raw, std::span<Estimate> estimates) noexcept {
  assert(raw.size() == size() * raw_inputs().size() && estimates.size() == size());
  rows_->step(raw, estimates);
}

void EstimatorBatch::reset() noexcept {
  for (std::size_t row = 0; row < size(); ++row) reset(row);
}
void EstimatorBatch::reset(std::size_t row) noexcept {
  assert(row < size());
  rows_->reset(row);
}

std::size_t EstimatorBatch::state_size() const noexcept {
  return detail::kStateHeaderBytes + rows_->state_bytes;
}

bool EstimatorBatch::save(std::size_t row, std::span<std::byte> bytes) noexcept {
  assert(row < size());
  if (bytes.size() != state_size()) return false;
  const bool was_at_rest = rows_->is_at_rest[row] != 0;
  rows_->leave_rest(row);
  rows_->is_at_rest[row] = static_cast<std::uint8_t>(was_at_rest);
  std::ranges::copy(rows_->state(row), bytes.begin() + detail::kStateHeaderBytes);
  detail::write_state_header(bytes, rows_->identity);
  return true;
}

bool EstimatorBatch::is_state(std::span<const std::byte> bytes) noexcept {
  return detail::load_state(rows_->worker, rows_->identity, bytes);
}

bool EstimatorBatch::load(std::size_t row, std::span<const std::byte> bytes) noexcept {
  assert(row < size());
  if (!is_state(bytes)) return false;
  rows_->is_at_rest[row] = 0;
  std::ranges::copy(bytes.subspan(detail::kStateHeaderBytes), rows_->state(row).begin());
  rows_->find_rest(row);
  return true;
}

}  // namespace torsio
