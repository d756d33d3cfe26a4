#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "files/safetensors.hpp"
#include "model/common/parameters.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// A leaf field as a tensor: a number of shape [], a vector [n], a matrix [rows, columns]; doubles
/// as F64, floats as F32, `std::size_t` as I64, `bool` as U8.
[[nodiscard]] Tensor tensor_of(double value);
[[nodiscard]] Tensor tensor_of(bool value);
[[nodiscard]] Tensor tensor_of(std::size_t value);
[[nodiscard]] Tensor tensor_of(const std::vector<double>& values);
[[nodiscard]] Tensor tensor_of(const std::vector<float>& values);
[[nodiscard]] Tensor tensor_of(const Matrix& values);
[[nodiscard]] Tensor tensor_of(const FloatMatrix& values);

/// Reads a leaf field back. @throws Error at `place` for another element type, another number of
/// dimensions or a number out of the field's range; numbers may be anything.
void read_tensor(const Tensor& tensor, const std::string& place, double& value);
void read_tensor(const Tensor& tensor, const std::string& place, bool& value);
void read_tensor(const Tensor& tensor, const std::string& place, std::size_t& value);
void read_tensor(const Tensor& tensor, const std::string& place, std::vector<double>& values);
void read_tensor(const Tensor& tensor, const std::string& place, std::vector<float>& values);
void read_tensor(const Tensor& tensor, const std::string& place, Matrix& values);
void read_tensor(const Tensor& tensor, const std::string& place, FloatMatrix& values);

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

/// No list of a model file is longer; a file that says so is refused before memory is taken.
inline constexpr std::size_t kMostElements = kMostLayers;

/// How many elements `contents` has of the list of that name: its tensors are called
/// "name.0.field", "name.1.field", ...
/// @throws Error if an index is left out or there are more elements than `kMostElements`.
[[nodiscard]] std::size_t list_size(const Safetensors& contents, const std::string& name,
                                    std::string_view file);

/// Gives every list in `fields` as many elements as `contents` has of it.
template <HasFields Fields>
void size_lists(const Safetensors& contents, const std::string& prefix, std::string_view file,
                Fields& fields) {
  Fields::visit_fields(fields, [&](std::string_view field_name, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    const std::string path = prefix + "." + std::string(field_name);
    if constexpr (FieldList<Field>) {
      field.resize(list_size(contents, path, file));
      for (std::size_t i = 0; i < field.size(); ++i)
        size_lists(contents, path + "." + std::to_string(i), file, field[i]);
    } else if constexpr (HasFields<Field>) {
      size_lists(contents, path, file, field);
    }
  });
}

/// The reverse of `put_leaves`.
template <HasFields Fields>
void take_leaves(Safetensors& contents, const std::string& prefix, std::string_view file,
                 Fields& fields, const std::function<bool(std::string_view)>& may_be_nan) {
  size_lists(contents, prefix, file, fields);
  for_each_leaf(
      fields,
      [&](const std::string& path, auto& leaf) {
        read_tensor(take_tensor(contents, path, file, may_be_nan(path)),
                    std::string(file) + ": /" + path, leaf);
      },
      prefix);
}

}  // namespace torsio
