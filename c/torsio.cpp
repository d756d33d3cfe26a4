#include "torsio.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "torsio/core/version.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/files/model_file.hpp"

struct torsio_estimator {
  torsio::Estimator estimator;
};

namespace {

using torsio::Fault;

// Not a string: a message must stay valid while the arguments of one printf are evaluated.
thread_local std::array<char, 1024> last_error{};

void keep_error(std::string_view text) noexcept {
  const std::size_t length = std::min(text.size(), last_error.size() - 1);
  std::memcpy(last_error.data(), text.data(), length);
  last_error[length] = '\0';
}

/// No exception passes this: `work`, or what it returns on failure, with the reason kept.
template <class Work>
auto guarded(const Work& work, std::invoke_result_t<const Work&> on_failure) noexcept {
  try {
    return work();
  } catch (const std::exception& error) {
    keep_error(error.what());
  } catch (...) {
    keep_error("an unknown error");
  }
  return on_failure;
}

std::string_view text_or_empty(const char* text) noexcept {
  return text == nullptr ? std::string_view{} : std::string_view(text);
}

template <class Result>
Result refuse(std::string_view why, Result result) noexcept {
  keep_error(why);
  return result;
}

/// @param rate_hz NaN: that in the file
torsio_estimator* loaded(const char* path, const char* expected_serial, double rate_hz) noexcept {
  if (path == nullptr) return refuse("the path is NULL", static_cast<torsio_estimator*>(nullptr));
  return guarded(
      [&] {
        return new torsio_estimator{torsio::load_estimator(
            path, {.rate_Hz = rate_hz, .serial = std::string(text_or_empty(expected_serial))})};
      },
      nullptr);
}

constexpr std::string_view kNoEstimator = "the estimator is NULL: was its load checked?";
constexpr std::string_view kNullPointer = "a pointer is NULL";

torsio_estimate plain(const torsio::Estimate& estimate) noexcept {
  return {.value = estimate.value,
          .std_dev = estimate.std_dev,
          .novelty = estimate.novelty,
          .fault = static_cast<std::int32_t>(estimate.fault),
          .reserved = 0};
}

std::span<const double> row(const double* raw, std::size_t count) noexcept {
  return raw == nullptr ? std::span<const double>{} : std::span(raw, count);
}

constexpr std::int32_t number(Fault fault) { return static_cast<std::int32_t>(fault); }
static_assert(number(Fault::none) == TORSIO_FAULT_NONE &&
              number(Fault::input_not_finite) == TORSIO_FAULT_INPUT_NOT_FINITE &&
              number(Fault::input_count_wrong) == TORSIO_FAULT_INPUT_COUNT_WRONG &&
              number(Fault::warming_up) == TORSIO_FAULT_WARMING_UP &&
              number(Fault::zero_not_set) == TORSIO_FAULT_ZERO_NOT_SET &&
              number(Fault::outside_training_range) == TORSIO_FAULT_OUTSIDE_TRAINING_RANGE &&
              number(Fault::recovering) == TORSIO_FAULT_RECOVERING &&
              number(Fault::wrong_rate) == TORSIO_FAULT_WRONG_RATE &&
              number(Fault::model_not_finite) == TORSIO_FAULT_MODEL_NOT_FINITE &&
              number(Fault::diverged) == TORSIO_FAULT_DIVERGED);
static_assert(sizeof(torsio_estimate) == 32);

}  // namespace

extern "C" {

int torsio_abi_version() { return TORSIO_ABI_VERSION; }
const char* torsio_version() { return torsio::kVersion; }
const char* torsio_last_error() { return last_error.data(); }

const char* torsio_fault_name(int32_t fault) {
  if (fault < 0 || fault > TORSIO_FAULT_DIVERGED) return "unknown";
  return torsio::name(static_cast<Fault>(fault)).data();  // a literal
}

torsio_estimator* torsio_load(const char* path, const char* expected_serial) {
  return loaded(path, expected_serial, torsio::kNotMeasured);
}

torsio_estimator* torsio_load_at_rate(const char* path, const char* expected_serial,
                                      double rate_hz) {
  if (!(std::isfinite(rate_hz) && rate_hz > 0.0))
    return refuse("the rate is not a positive number", static_cast<torsio_estimator*>(nullptr));
  return loaded(path, expected_serial, rate_hz);
}

torsio_estimator* torsio_load_bytes(const void* bytes, size_t size, const char* expected_serial) {
  if (bytes == nullptr) return refuse(kNullPointer, static_cast<torsio_estimator*>(nullptr));
  return guarded(
      [&] {
        return new torsio_estimator{torsio::make_estimator(
            torsio::parse_model(std::span(static_cast<const std::byte*>(bytes), size),
                                "the model in memory", text_or_empty(expected_serial)))};
      },
      nullptr);
}

torsio_estimator* torsio_clone(const torsio_estimator* estimator) {
  if (estimator == nullptr) return refuse(kNoEstimator, static_cast<torsio_estimator*>(nullptr));
  return guarded([&] { return new torsio_estimator(*estimator); }, nullptr);
}

void torsio_free(torsio_estimator* estimator) { delete estimator; }

size_t torsio_input_count(const torsio_estimator* estimator) {
  return estimator == nullptr ? 0 : estimator->estimator.raw_inputs().size();
}

const char* torsio_input_name(const torsio_estimator* estimator, size_t index) {
  return index < torsio_input_count(estimator) ? estimator->estimator.raw_inputs()[index].c_str()
                                               : nullptr;
}

const char* torsio_target_name(const torsio_estimator* estimator) {
  return estimator == nullptr ? nullptr : estimator->estimator.settings().target.c_str();
}

double torsio_sample_rate_hz(const torsio_estimator* estimator) {
  return estimator == nullptr ? 0.0 : estimator->estimator.settings().sample_rate_Hz;
}

int torsio_set_zero(torsio_estimator* estimator, const char* channel, double value) {
  if (estimator == nullptr) return refuse(kNoEstimator, -1);
  return guarded(
      [&] {
        estimator->estimator.set_zero(text_or_empty(channel), value);
        return 0;
      },
      -1);
}

const char* torsio_unset_zero(const torsio_estimator* estimator, size_t index) {
  if (estimator == nullptr || index >= estimator->estimator.unset_zeros().size()) return nullptr;
  return estimator->estimator.unset_zeros()[index].c_str();
}

void torsio_reset(torsio_estimator* estimator) {
  if (estimator != nullptr) estimator->estimator.reset();
}

torsio_estimate torsio_step(torsio_estimator* estimator, const double* raw, size_t count) {
  if (estimator == nullptr) return plain({.fault = Fault::input_count_wrong});
  return plain(estimator->estimator.step(row(raw, count)));
}

int torsio_step_into(torsio_estimator* estimator, const double* raw, size_t count,
                     torsio_estimate* out) {
  if (estimator == nullptr) return refuse(kNoEstimator, -1);
  if (raw == nullptr || out == nullptr) return refuse(kNullPointer, -1);
  *out = torsio_step(estimator, raw, count);
  return 0;
}

size_t torsio_run(torsio_estimator* estimator, const double* raw, size_t rows, size_t count,
                  torsio_estimate* out) {
  if (estimator == nullptr) return refuse(kNoEstimator, std::size_t{0});
  if (rows == 0) return 0;
  if (raw == nullptr || out == nullptr) return refuse(kNullPointer, std::size_t{0});
  for (std::size_t n = 0; n < rows; ++n) out[n] = torsio_step(estimator, raw + n * count, count);
  return rows;
}

size_t torsio_state_size(const torsio_estimator* estimator) {
  return estimator == nullptr ? 0 : estimator->estimator.state_size();
}

int torsio_state_save(const torsio_estimator* estimator, void* bytes, size_t size) {
  if (estimator == nullptr) return refuse(kNoEstimator, -1);
  if (bytes == nullptr) return refuse(kNullPointer, -1);
  if (estimator->estimator.save(std::span(static_cast<std::byte*>(bytes), size))) return 0;
  return refuse("the buffer does not have torsio_state_size bytes", -1);
}

int torsio_state_load(torsio_estimator* estimator, const void* bytes, size_t size) {
  if (estimator == nullptr) return refuse(kNoEstimator, -1);
  if (bytes == nullptr) return refuse(kNullPointer, -1);
  if (estimator->estimator.load(std::span(static_cast<const std::byte*>(bytes), size))) return 0;
  return refuse("these bytes are not a state of this model", -1);
}

}  // extern "C"
