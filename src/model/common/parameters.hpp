#pragma once

#include <concepts>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// A struct that names its fields once, for everything that must walk them (model files, parameter
/// counts, comparisons):
///
///     template <class Self, class Visit>
///     static void visit_fields(Self& self, Visit&& visit) {
///       visit("stiffness", self.stiffness);
///       visit("knots", self.knots);
///     }
///
/// A field is a `double`, `bool`, `std::size_t`, `std::vector<double>`, `std::vector<float>`,
/// `Matrix`, `FloatMatrix`, or again such a struct, or a list (`std::vector`) of such structs.
template <class T>
concept HasFields = requires(T value) { T::visit_fields(value, [](std::string_view, auto&) {}); };

template <class T>
concept LeafField =
    std::same_as<T, double> || std::same_as<T, bool> || std::same_as<T, std::size_t> ||
    std::same_as<T, std::vector<double>> || std::same_as<T, Matrix> ||
    std::same_as<T, std::vector<float>> || std::same_as<T, FloatMatrix>;

template <class T>
struct IsFieldList : std::false_type {};
template <HasFields T>
struct IsFieldList<std::vector<T>> : std::true_type {};
template <class T>
concept FieldList = IsFieldList<T>::value;

/// Calls `visit(path, leaf)` for every leaf; nested names are joined by a point, elements of a list
/// have their index for a name: "coefficients.knots", "layers.0.weights".
template <class T, class Visit>
void for_each_leaf(T& value, Visit&& visit, const std::string& prefix = {}) {
  std::remove_const_t<T>::visit_fields(value, [&](std::string_view field_name, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    const std::string path =
        prefix.empty() ? std::string(field_name) : prefix + "." + std::string(field_name);
    if constexpr (LeafField<Field>) {
      visit(path, field);
    } else if constexpr (FieldList<Field>) {
      for (std::size_t i = 0; i < field.size(); ++i)
        for_each_leaf(field[i], visit, path + "." + std::to_string(i));
    } else {
      static_assert(HasFields<Field>, "a field must be a leaf or list its own fields");
      for_each_leaf(field, visit, path);
    }
  });
}

}  // namespace torsio
