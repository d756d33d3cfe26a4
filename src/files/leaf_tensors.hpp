#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "torsio/core/matrix.hpp"
#include "torsio/files/safetensors.hpp"
#include "torsio/model/parameters.hpp"

namespace torsio {

/// A leaf field as a tensor: a number of shape [], a vector [n], a matrix [rows, columns]; doubles
/// as F64, `std::size_t` as I64, `bool` as U8.
[[nodiscard]] Tensor tensor_of(double value);
[[nodiscard]] Tensor tensor_of(bool value);
[[nodiscard]] Tensor tensor_of(std::size_t value);
[[nodiscard]] Tensor tensor_of(const std::vector<double>& values);
[[nodiscard]] Tensor tensor_of(const Matrix& values);

/// Reads a leaf field back. @throws Error at `place` for another element type, another number of
/// dimensions or a number out of the field's range; numbers may be anything.
void read_tensor(const Tensor& tensor, const std::string& place, double& value);
void read_tensor(const Tensor& tensor, const std::string& place, bool& value);
void read_tensor(const Tensor& tensor, const std::string& place, std::size_t& value);
void read_tensor(const Tensor& tensor, const std::string& place, std::vector<double>& values);
void read_tensor(const Tensor& tensor, const std::string& place, Matrix& values);

/// Adds every leaf of `fields` under "prefix.path".
template <HasFields Fields>
void put_leaves(Safetensors& contents, const std::string& prefix, const Fields& fields) {
  for_each_leaf(
      fields,
      [&](const std::string& path, const auto& leaf) { contents.tensors[path] = tensor_of(leaf); },
      prefix);
}

/// Takes the tensor of that name out of `contents`, so that what remains was asked for by nobody.
/// @throws Error if there is none, or it holds numbers that are not finite (NaN excepted where
/// `may_be_nan`: an error bar without evidence).
[[nodiscard]] Tensor take_tensor(Safetensors& contents, const std::string& name,
                                 std::string_view file, bool may_be_nan);

/// The reverse of `put_leaves`.
template <HasFields Fields>
void take_leaves(Safetensors& contents, const std::string& prefix, std::string_view file,
                 Fields& fields, const std::function<bool(std::string_view)>& may_be_nan) {
  for_each_leaf(
      fields,
      [&](const std::string& path, auto& leaf) {
        read_tensor(take_tensor(contents, path, file, may_be_nan(path)),
                    std::string(file) + ": /" + path, leaf);
      },
      prefix);
}

}  // namespace torsio
