#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
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

/// Takes the tensor of that name out of `contents`, so that only unknown tensors remain at the end.
/// @throws Error if there is none, or it holds numbers that are not finite (NaN excepted where
/// `may_be_nan`: an error bar without evidence).
[[nodiscard]] Tensor take_tensor(Safetensors& contents, const std::string& name,
                                 std::string_view file, bool may_be_nan);

/// No list of a model file is longer; a file with a longer one is refused before memory is
/// allocated.
inline constexpr std::size_t kMaxElements = kMaxLayers;

/// How many elements `contents` has of the list of that name: its tensors are called
/// "name.0.field", "name.1.field", ...
/// @throws Error if an index is left out or there are more elements than `kMaxElements`.
[[nodiscard]] std::size_t list_size(const Safetensors& contents, const std::string& name,
                                    std::string_view file);

/// Whether `contents` has a tensor below that name: "name.field".
[[nodiscard]] bool has_tensors_of(const Safetensors& contents, const std::string& name);

/// Which of the alternatives `contents` has of the variant of that name: its tensors are called
/// "name.alternative.field". An empty name among the alternatives is chosen where there is no
/// tensor.
/// @throws Error that names a tensor of a second alternative, or of one that is not in the list, or
/// the variant if it has no tensor and must have one.
[[nodiscard]] std::size_t alternative_index(const Safetensors& contents, const std::string& name,
                                            std::span<const std::string_view> alternatives,
                                            std::string_view file);

template <HasFields Fields>
void shape_fields(const Safetensors& contents, const std::string& prefix, std::string_view file,
                  Fields& fields);

/// Gives a variant the alternative that `contents` has.
template <class... Alternative>
void shape_variant(const Safetensors& contents, const std::string& path, std::string_view file,
                   std::variant<Alternative...>& field) {
  static constexpr std::array<std::string_view, sizeof...(Alternative)> kNames{
      alternative_name<Alternative>()...};
  const std::size_t index = alternative_index(contents, path, kNames, file);
  const auto take = [&]<class Chosen>(std::type_identity<Chosen> /*alternative*/) {
    auto& chosen = field.template emplace<Chosen>();
    if constexpr (HasFields<Chosen>)
      shape_fields(contents, path + "." + std::string(kNames[index]), file, chosen);
  };
  std::size_t i = 0;
  ((i++ == index ? take(std::type_identity<Alternative>()) : void()), ...);
}

/// Gives every list in `fields` as many elements as `contents` has of it, and every optional and
/// variant the value that `contents` has.
template <HasFields Fields>
void shape_fields(const Safetensors& contents, const std::string& prefix, std::string_view file,
                  Fields& fields) {
  Fields::visit_fields(fields, [&](std::string_view field_name, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    const std::string path = prefix + "." + std::string(field_name);
    if constexpr (FieldList<Field>) {
      field.resize(list_size(contents, path, file));
      for (std::size_t i = 0; i < field.size(); ++i)
        shape_fields(contents, path + "." + std::to_string(i), file, field[i]);
    } else if constexpr (OptionalFields<Field>) {
      field.reset();
      if (has_tensors_of(contents, path)) shape_fields(contents, path, file, field.emplace());
    } else if constexpr (VariantFields<Field>) {
      shape_variant(contents, path, file, field);
    } else if constexpr (HasFields<Field>) {
      shape_fields(contents, path, file, field);
    }
  });
}

/// The reverse of `put_leaves`.
template <HasFields Fields>
void take_leaves(Safetensors& contents, const std::string& prefix, std::string_view file,
                 Fields& fields, const std::function<bool(std::string_view)>& may_be_nan) {
  shape_fields(contents, prefix, file, fields);
  for_each_leaf(
      fields,
      [&](const std::string& path, auto& leaf) {
        read_tensor(take_tensor(contents, path, file, may_be_nan(path)),
                    std::string(file) + ": /" + path, leaf);
      },
      prefix);
}

}  // namespace torsio
