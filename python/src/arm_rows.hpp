#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bindings.hpp"

namespace torsio::python {

using Shape = std::vector<py::ssize_t>;

/// Numbers of shape (..., joints): one row per pose, however many leading dimensions there are.
class JointRows {
 public:
  JointRows(const py::handle& object, std::size_t joints, const std::string& name)
      : joints_(joints), array_(decltype(array_)::ensure(unmasked(object))) {
    if (!array_) PyErr_Clear();
    if (!array_ || array_.ndim() < 1 ||
        array_.shape(array_.ndim() - 1) != static_cast<py::ssize_t>(joints))
      throw UsageError({.place = name,
                        .expected = "numbers of shape (..., " + std::to_string(joints) +
                                    "), one per joint of the arm",
                        .found = kind_of(object)});
  }

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(array_.size()) / joints_;
  }
  [[nodiscard]] Shape leading() const {
    return {array_.shape(), array_.shape() + array_.ndim() - 1};
  }
  [[nodiscard]] std::span<const double> row(std::size_t index) const {
    return {array_.data() + index * joints_, joints_};
  }
  /// @throws UsageError if the leading dimensions differ
  void require_like(const JointRows& other, const std::string& name) const {
    if (leading() == other.leading()) return;
    throw UsageError({.place = name,
                      .expected = "the shape of the angles, " + kind_of(other.array_),
                      .found = kind_of(array_)});
  }

 private:
  std::size_t joints_;
  py::array_t<double, py::array::c_style | py::array::forcecast> array_;
};

/// A new array of shape (..., tail), written row by row.
class RowsOut {
 public:
  RowsOut(Shape leading, const Shape& tail) {
    for (const py::ssize_t width : tail) width_ *= static_cast<std::size_t>(width);
    leading.insert(leading.end(), tail.begin(), tail.end());
    array = py::array_t<double>(leading);
    data_ = array.mutable_data();
  }
  [[nodiscard]] std::span<double> row(std::size_t index) const {
    return {data_ + index * width_, width_};
  }

  py::array_t<double> array;

 private:
  std::size_t width_ = 1;
  double* data_ = nullptr;
};

/// The arm that comes with torsio; other names are files.
inline constexpr const char* kReadyArm = "arm6";

void bind_arm_simulation(py::module_& module);

}  // namespace torsio::python
