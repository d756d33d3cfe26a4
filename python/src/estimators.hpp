#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio::python {

/// Rows of numbers of any type and strides, read without a copy where they are double.
class Rows {
 public:
  /// @param place of the call, for messages. @throws UsageError for anything but numbers of shape
  /// (rows, channels), or (rows,) if there is one channel.
  Rows(const py::handle& object, const std::vector<std::string>& channels,
       const std::string& place);

  [[nodiscard]] std::size_t size() const noexcept { return rows_; }
  /// @param row `channels` numbers
  void copy(std::size_t index, std::span<double> row) const noexcept {
    const char* from = data_ + static_cast<py::ssize_t>(index) * row_stride_;
    for (double& number : row) {
      __builtin_memcpy(&number, from, sizeof number);
      from += column_stride_;
    }
  }

 private:
  py::array array_;
  const char* data_ = nullptr;
  std::size_t rows_ = 0;
  py::ssize_t row_stride_ = 0;
  py::ssize_t column_stride_ = 0;
};

/// Value, error bar, novelty and fault of each row, as arrays.
class EstimateArrays {
 public:
  explicit EstimateArrays(std::size_t rows);
  /// Writes into the arrays of `out`, `torsio.Estimates`, or into new ones if it is None.
  /// @param place of the call, for messages. @throws UsageError for other types or shapes, or for
  /// arrays that are read-only, not contiguous, or share memory with each other.
  EstimateArrays(std::size_t rows, const py::object& out, const std::string& place);
  void set(std::size_t row, const Estimate& estimate) noexcept {
    value_[row] = estimate.value;
    std_dev_[row] = estimate.std_dev;
    novelty_[row] = estimate.novelty;
    fault_[row] = static_cast<std::uint8_t>(estimate.fault);
  }
  /// `torsio.Estimates`: `out`, where it was given.
  [[nodiscard]] py::object result() const;

 private:
  py::object out_ = py::none();
  py::array_t<double> values_;
  py::array_t<double> std_devs_;
  py::array_t<double> novelties_;
  py::array_t<std::uint8_t> faults_;
  double* value_;
  double* std_dev_;
  double* novelty_;
  std::uint8_t* fault_;
};

/// An estimator is used by one thread at a time; a second one is refused instead of mixing two runs.
class InUse {
 public:
  explicit InUse(std::atomic<bool>& flag);
  ~InUse() { flag_.store(false, std::memory_order_release); }
  InUse(const InUse&) = delete;
  InUse& operator=(const InUse&) = delete;

 private:
  std::atomic<bool>& flag_;
};

/// An estimator as Python holds it.
struct PythonEstimator {
  PythonEstimator(std::shared_ptr<const ModelFile> model, double sample_rate_Hz);
  PythonEstimator(const PythonEstimator& other);

  void set_zero(const std::string& channel, double value);

  std::shared_ptr<const ModelFile> file;
  double rate_Hz;
  Estimator estimator;
  std::map<std::string, double> zeros = {};
  std::vector<double> row;  ///< the channels in one step
  mutable std::atomic<bool> is_in_use =
      false;  ///< reading a state while it changes is refused, too
};

/// The rate of a model file where none is asked for.
[[nodiscard]] double rate_of(const ModelFile& file, std::optional<double> rate_Hz);

}  // namespace torsio::python

namespace pybind11::detail {

template <>
struct type_caster<torsio::python::PythonEstimator>
    : InitialisedCaster<torsio::python::PythonEstimator> {};

}  // namespace pybind11::detail
