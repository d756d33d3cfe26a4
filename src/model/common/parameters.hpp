#pragma once

#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
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
/// `Matrix`, `FloatMatrix`, or again such a struct, or of such structs a list (`std::vector`), a
/// `std::optional` or a `std::variant`. The alternatives of a variant are parameters of families, by
/// whose names they are known, and perhaps `std::monostate` for none of them. A struct that may be
/// absent has a leaf that every value of it has: it is by its leaves that a file has it.
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

template <class T>
struct IsOptionalFields : std::false_type {};
template <HasFields T>
struct IsOptionalFields<std::optional<T>> : std::true_type {};
template <class T>
concept OptionalFields = IsOptionalFields<T>::value;

template <class T>
concept NamedAlternative = std::same_as<T, std::monostate> || (HasFields<T> && requires {
                             { T::Family::kFamily } -> std::convertible_to<std::string_view>;
                           });
template <class T>
struct IsVariantFields : std::false_type {};
template <NamedAlternative... T>
struct IsVariantFields<std::variant<T...>> : std::true_type {};
template <class T>
concept VariantFields = IsVariantFields<T>::value;

/// Name of an alternative of a variant: "mlp"; that of `std::monostate` is empty.
template <NamedAlternative T>
[[nodiscard]] constexpr std::string_view alternative_name() noexcept {
  if constexpr (std::same_as<T, std::monostate>) {
    return {};
  } else {
    return T::Family::kFamily;
  }
}

template <class T, class Visit>
void for_each_leaf(T& value, Visit&& visit, const std::string& prefix = {});

/// The same for one field, whose own path is given.
template <class Field, class Visit>
void for_each_leaf_of_field(Field& field, Visit&& visit, const std::string& path) {
  using Type = std::remove_const_t<Field>;
  if constexpr (LeafField<Type>) {
    visit(path, field);
  } else if constexpr (FieldList<Type>) {
    for (std::size_t i = 0; i < field.size(); ++i)
      for_each_leaf(field[i], visit, path + "." + std::to_string(i));
  } else if constexpr (OptionalFields<Type>) {
    if (field.has_value()) for_each_leaf(*field, visit, path);
  } else if constexpr (VariantFields<Type>) {
    std::visit(
        [&]<class Alternative>(Alternative& alternative) {
          using Named = std::remove_const_t<Alternative>;
          if constexpr (!std::same_as<Named, std::monostate>)
            for_each_leaf(alternative, visit, path + "." + std::string(alternative_name<Named>()));
        },
        field);
  } else {
    static_assert(HasFields<Type>, "a field must be a leaf or list its own fields");
    for_each_leaf(field, visit, path);
  }
}

/// Calls `visit(path, leaf)` for every leaf; nested names are joined by a point, elements of a list
/// have their index for a name, alternatives of a variant that of their family:
/// "coefficients.knots", "layers.0.weights", "residual.model.mlp.layers.0.weights".
template <class T, class Visit>
void for_each_leaf(T& value, Visit&& visit, const std::string& prefix) {
  std::remove_const_t<T>::visit_fields(value, [&](std::string_view name, auto& field) {
    for_each_leaf_of_field(field, visit,
                           prefix.empty() ? std::string(name) : prefix + "." + std::string(name));
  });
}

}  // namespace torsio
