#include "torsio/export/warp_kernel.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "export/warp_module.hpp"
#include "export/warp_table.hpp"

namespace torsio {
namespace {

using WarpOperation = GraphOperation;
using WarpNode = StepGraph::Node;
using WarpIndex = StepGraph::Index;

/// Rows up to this width are variables, one for each column; wider ones are arrays with loops over them.
constexpr std::size_t kUnrolledWidth = 16;
/// Multiplications of a product that is written without loops.
constexpr std::size_t kUnrolledProduct = 64;

/// Where the columns of a row are: in variables, or side by side in an array.
struct WarpRow {
  std::vector<std::string> columns = {};
  std::string array = {};  ///< empty: in variables
  std::size_t first = 0;

  [[nodiscard]] bool is_in_array() const noexcept { return !array.empty(); }
};

/// Types as in the text: 64, 32, or 0 for a truth.
class WarpTypes {
 public:
  explicit WarpTypes(GraphPrecision precision) : precision_(precision) {}
  [[nodiscard]] int bits(StepGraph::Type type) const {
    switch (type) {
      case StepGraph::Type::real: return precision_ == GraphPrecision::twofold ? 64 : 32;
      case StepGraph::Type::wide: return precision_ == GraphPrecision::single ? 32 : 64;
      case StepGraph::Type::single: return 32;
      case StepGraph::Type::truth: break;
    }
    return 0;
  }

 private:
  GraphPrecision precision_;
};

class WarpWriter {
 public:
  explicit WarpWriter(const StepGraph& graph)
      : graph_(graph), types_(graph.precision), rows_(graph.nodes.size()) {}

  WarpModuleParts parts() {
    const WarpNode& last = graph_.nodes[graph_.next_state];
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
      if (graph_.nodes[i].operation == WarpOperation::constant) continue;
      // The next state is written part by part.
      if (i == graph_.next_state && last.operation == WarpOperation::joined) continue;
      rows_[i] = added(static_cast<WarpIndex>(i));
    }
    add_results();
    add_next_state();
    WarpModuleParts parts;
    parts.kernel = std::move(text_);
    parts.has_functions_32 = has_functions_32_;
    parts.has_functions_64 = has_functions_64_;
    parts.table_32 = table_32_.text();
    parts.table_64 = table_64_.text();
    parts.work_32 = work_32_;
    parts.work_64 = work_64_;
    parts.has_wide_state = bits_of(1) == 64;
    parts.has_wide_values = bits_of(graph_.value) == 64;
    return parts;
  }

 private:
  [[nodiscard]] int bits_of(WarpIndex index) const { return types_.bits(graph_.nodes[index].type); }
  [[nodiscard]] std::size_t width_of(WarpIndex index) const { return graph_.nodes[index].width; }
  static std::string number_type(int bits) { return fmt::format("wp.float{}", bits); }

  void line(const std::string& text, int depth = 1) {
    text_ += std::string(static_cast<std::size_t>(4 * depth), ' ') + text + "\n";
  }

  /// A name that is not used again.
  std::string fresh(const char* letter) { return fmt::format("{}{}", letter, ++names_); }

  /// The columns of a row as variables of the kernel.
  static std::string element(const std::string& array, const std::string& place) {
    if (array == "state" || array == "inputs") return fmt::format("{}[i, {}]", array, place);
    if (array.starts_with("table")) return fmt::format("{}[{}]", array, place);
    return fmt::format("{}[{}, i]", array, place);
  }

  static std::string sum_of(std::size_t first, const std::string& variable) {
    return first == 0 ? variable : fmt::format("{} + {}", first, variable);
  }

  WarpTable& table(int bits) { return bits == 64 ? table_64_ : table_32_; }

  /// A number in the code, if Warp reads it without rounding: it has 32 bits there.
  static std::optional<std::string> literal(double value, int bits) {
    if (bits == 0) return value != 0.0 ? "True" : "False";
    const auto single = static_cast<double>(static_cast<float>(value));
    if (!std::isfinite(single) || (bits == 64 && single != value)) return std::nullopt;
    return fmt::format("wp.float{}({})", bits, python_number(value, bits));
  }

  const WarpRow& row(WarpIndex index) {
    WarpRow& own = rows_[index];
    const WarpNode& node = graph_.nodes[index];
    if (node.operation != WarpOperation::constant || own.is_in_array() || !own.columns.empty())
      return own;
    const int bits = types_.bits(node.type);
    if (node.width > kUnrolledWidth) {
      own = {.array = fmt::format("table_{}", bits), .first = table(bits).add(node.values)};
      return own;
    }
    for (std::size_t j = 0; j < node.width; ++j) {
      const double value = node.values(0, j);
      if (const auto text = literal(value, bits)) {
        own.columns.push_back(*text);
        continue;
      }
      const Matrix number(1, 1, value);
      own.columns.push_back(bound(fmt::format("table_{}", bits), table(bits).add(number)));
    }
    return own;
  }

  /// A variable with an element of an array. Elements are written once, before they are read, but for those of the state.
  std::string bound(const std::string& array, std::size_t place) {
    const auto [known, is_new] = bound_.try_emplace({array, place});
    if (is_new) {
      known->second = fresh("v");
      line(fmt::format("{} = {}", known->second, element(array, std::to_string(place))));
    }
    return known->second;
  }

  std::string column(WarpIndex index, std::size_t j) {
    const std::size_t place = width_of(index) == 1 ? 0 : j;
    const WarpRow own = row(index);
    return own.is_in_array() ? bound(own.array, own.first + place) : own.columns.at(place);
  }

  std::vector<std::string> all_columns(WarpIndex index) {
    std::vector<std::string> columns;
    for (std::size_t j = 0; j < width_of(index); ++j) columns.push_back(column(index, j));
    return columns;
  }

  /// Room for a row in the array of intermediate rows.
  WarpRow room(int bits, std::size_t width) {
    if (bits == 0) throw std::logic_error("a wide row of truths");
    std::size_t& used = bits == 64 ? work_64_ : work_32_;
    WarpRow row{.array = fmt::format("work_{}", bits), .first = used};
    used += width;
    return row;
  }

  /// The row in an array, where loops reach it.
  WarpRow in_array(WarpIndex index) {
    WarpRow own = row(index);
    if (own.is_in_array()) return own;
    const auto [known, is_new] = copies_.try_emplace(index);
    if (!is_new) return known->second;
    const std::vector<std::string> columns = all_columns(index);
    WarpRow copy = room(bits_of(index), columns.size());
    for (std::size_t j = 0; j < columns.size(); ++j)
      line(fmt::format("{} = {}", element(copy.array, std::to_string(copy.first + j)), columns[j]));
    known->second = copy;
    return copy;
  }

  std::string called(const char* function, int bits, const std::vector<std::string>& arguments) {
    if (bits == 64) has_functions_64_ = true;
    if (bits == 32) has_functions_32_ = true;
    return fmt::format("{}_{}({})", function, bits, fmt::join(arguments, ", "));
  }

  /// A column from those of the operands.
  std::string expression(const WarpNode& node, const std::vector<std::string>& of) {
    const int bits = types_.bits(node.type);
    const auto between = [&](const char* sign) {
      return fmt::format("{} {} {}", of[0], sign, of[1]);
    };
    const auto builtin = [&](const char* function) {
      return fmt::format("wp.{}({})", function, fmt::join(of, ", "));
    };
    switch (node.operation) {
      case WarpOperation::add: return between("+");
      case WarpOperation::subtract: return between("-");
      case WarpOperation::multiply: return between("*");
      case WarpOperation::divide: return between("/");
      case WarpOperation::less: return between("<");
      case WarpOperation::less_or_equal: return between("<=");
      case WarpOperation::both: return between("and");
      case WarpOperation::either: return between("or");
      case WarpOperation::is_not: return "not " + of[0];
      case WarpOperation::negate: return "-" + of[0];
      case WarpOperation::minimum: return called("lower", bits, of);
      case WarpOperation::maximum: return called("higher", bits, of);
      case WarpOperation::sign: return called("sign", bits, of);
      case WarpOperation::sigmoid: return called("sigmoid", bits, of);
      case WarpOperation::power: return builtin("pow");
      case WarpOperation::absolute: return builtin("abs");
      case WarpOperation::square_root: return builtin("sqrt");
      case WarpOperation::exponential: return builtin("exp");
      case WarpOperation::tangent: return builtin("tanh");
      case WarpOperation::sine: return builtin("sin");
      case WarpOperation::cosine: return builtin("cos");
      case WarpOperation::arc_tangent: return builtin("atan");
      case WarpOperation::select:
        if (bits == 0)
          return fmt::format("({0} and {1}) or (not {0} and {2})", of[0], of[1], of[2]);
        return called("pick", bits, of);
      case WarpOperation::to_real:
      case WarpOperation::to_wide:
      case WarpOperation::to_single:
        if (bits_of(node.operands[0]) == 0)
          return called("pick", bits, {of[0], *literal(1.0, bits), *literal(0.0, bits)});
        return fmt::format("{}({})", number_type(bits), of[0]);
      default: break;
    }
    throw std::logic_error("unknown operation");
  }

  WarpRow added(WarpIndex index) {
    const WarpNode& node = graph_.nodes[index];
    switch (node.operation) {
      case WarpOperation::input: return {.array = "inputs"};
      case WarpOperation::state: return {.array = "state"};
      case WarpOperation::timestep: return {.columns = {"timestep_s"}};
      case WarpOperation::part: return part_of(node);
      case WarpOperation::joined: return joined_of(node);
      case WarpOperation::sum:
      case WarpOperation::largest: return reduced(node);
      case WarpOperation::product: return product_of(node);
      case WarpOperation::interpolation:
      case WarpOperation::held_interpolation: return interpolated_of(node);
      case WarpOperation::to_real:
      case WarpOperation::to_wide:
      case WarpOperation::to_single:
        if (bits_of(index) == bits_of(node.operands[0])) return row(node.operands[0]);
        break;
      default: break;
    }
    return node.width > kUnrolledWidth ? by_loop(node) : by_column(node);
  }

  WarpRow by_column(const WarpNode& node) {
    WarpRow result;
    for (std::size_t j = 0; j < node.width; ++j) {
      std::vector<std::string> of;
      for (const WarpIndex operand : node.operands) of.push_back(column(operand, j));
      const std::string value = expression(node, of);
      result.columns.push_back(fresh("v"));
      line(fmt::format("{} = {}", result.columns.back(), value));
    }
    return result;
  }

  WarpRow by_loop(const WarpNode& node) {
    std::vector<std::optional<WarpRow>> arrays;
    std::vector<std::string> of;
    for (const WarpIndex operand : node.operands) {
      const bool is_wide = width_of(operand) > 1;
      arrays.push_back(is_wide ? std::optional(in_array(operand)) : std::nullopt);
      of.push_back(is_wide ? fresh("v") : column(operand, 0));
    }
    WarpRow result = room(types_.bits(node.type), node.width);
    const std::string j = fresh("j");
    line(fmt::format("for {} in range({}):", j, node.width));
    for (std::size_t k = 0; k < of.size(); ++k)
      if (arrays[k])
        line(fmt::format("{} = {}", of[k], element(arrays[k]->array, sum_of(arrays[k]->first, j))),
             2);
    line(fmt::format("{} = {}", element(result.array, sum_of(result.first, j)),
                     expression(node, of)),
         2);
    return result;
  }

  WarpRow part_of(const WarpNode& node) {
    WarpRow own = row(node.operands[0]);
    if (own.is_in_array()) {
      own.first += node.first;
      return own;
    }
    const auto first = own.columns.begin() + static_cast<std::ptrdiff_t>(node.first);
    return {.columns = {first, first + static_cast<std::ptrdiff_t>(node.width)}};
  }

  WarpRow joined_of(const WarpNode& node) {
    WarpRow result;
    if (node.width <= kUnrolledWidth || !has_wide_operand(node)) {
      for (const WarpIndex operand : node.operands)
        for (const std::string& column : all_columns(operand)) result.columns.push_back(column);
      return result;
    }
    result = room(types_.bits(node.type), node.width);
    std::size_t place = result.first;
    for (const WarpIndex operand : node.operands) {
      copy(operand, result.array, place);
      place += width_of(operand);
    }
    return result;
  }

  [[nodiscard]] bool has_wide_operand(const WarpNode& node) const {
    return std::ranges::any_of(
        node.operands, [this](WarpIndex operand) { return width_of(operand) > kUnrolledWidth; });
  }

  /// Writes the row to the array, from this place on.
  void copy(WarpIndex index, const std::string& array, std::size_t place) {
    const std::size_t width = width_of(index);
    const WarpRow own = row(index);
    if (width > kUnrolledWidth && own.is_in_array()) {
      const std::string j = fresh("j");
      const std::string value = fresh("v");
      line(fmt::format("for {} in range({}):", j, width));
      line(fmt::format("{} = {}", value, element(own.array, sum_of(own.first, j))), 2);
      line(fmt::format("{} = {}", element(array, sum_of(place, j)), value), 2);
      return;
    }
    const std::vector<std::string> columns = all_columns(index);
    for (std::size_t j = 0; j < width; ++j)
      line(fmt::format("{} = {}", element(array, std::to_string(place + j)), columns[j]));
  }

  WarpRow reduced(const WarpNode& node) {
    const WarpIndex operand = node.operands[0];
    const std::size_t width = width_of(operand);
    const int bits = types_.bits(node.type);
    const auto joined_with = [&](const std::string& a, const std::string& b) {
      return node.operation == WarpOperation::sum ? fmt::format("{} + {}", a, b)
                                                  : called("higher", bits, {a, b});
    };
    const WarpRow own = row(operand);
    if (width <= kUnrolledWidth || !own.is_in_array()) {
      const std::vector<std::string> columns = all_columns(operand);
      std::string value = columns.front();
      for (std::size_t j = 1; j < width; ++j) {
        const std::string next = fresh("v");
        line(fmt::format("{} = {}", next, joined_with(value, columns[j])));
        value = next;
      }
      return {.columns = {value}};
    }
    const std::string value = fresh("v");
    const std::string next = fresh("v");
    const std::string j = fresh("j");
    line(fmt::format("{} = {}", value, element(own.array, std::to_string(own.first))));
    line(fmt::format("for {} in range(1, {}):", j, width));
    line(fmt::format("{} = {}", next, element(own.array, sum_of(own.first, j))), 2);
    line(fmt::format("{} = {}", value, joined_with(value, next)), 2);
    return {.columns = {value}};
  }

  WarpRow product_of(const WarpNode& node) {
    const WarpIndex operand = node.operands[0];
    const Matrix& matrix = graph_.nodes[node.operands[1]].values;
    const int bits = types_.bits(node.type);
    if (matrix.rows <= kUnrolledWidth && matrix.values.size() <= kUnrolledProduct)
      return short_product(all_columns(operand), matrix, bits);
    const WarpRow own = in_array(operand);
    const std::size_t place = table(bits).add(matrix);
    const std::string table_name = fmt::format("table_{}", bits);
    if (matrix.columns == 1)
      return {.columns = {dot_product(own, table_name, place, matrix, {}, 1)}};
    WarpRow result = room(bits, matrix.columns);
    const std::string j = fresh("j");
    line(fmt::format("for {} in range({}):", j, matrix.columns));
    const std::string value = dot_product(own, table_name, place, matrix, j, 2);
    line(fmt::format("{} = {}", element(result.array, sum_of(result.first, j)), value), 2);
    return result;
  }

  /// The sum of the products of a row in an array with a column of the matrix. The first summand is not a constant of the
  /// code, which Warp does not change in a loop.
  std::string dot_product(const WarpRow& row, const std::string& table_name, std::size_t place,
                          const Matrix& matrix, const std::string& j, int depth) {
    std::string value = fresh("v");
    const std::string left = fresh("v");
    const std::string right = fresh("v");
    const std::string k = fresh("j");
    const std::string of_column = j.empty() ? "" : " + " + j;
    line(fmt::format("{} = {} * {}", value, element(row.array, std::to_string(row.first)),
                     element(table_name, fmt::format("{}{}", place, of_column))),
         depth);
    line(fmt::format("for {} in range(1, {}):", k, matrix.rows), depth);
    line(fmt::format("{} = {}", left, element(row.array, sum_of(row.first, k))), depth + 1);
    line(fmt::format("{} = {}", right,
                     element(table_name,
                             fmt::format("{} + {} * {}{}", place, k, matrix.columns, of_column))),
         depth + 1);
    line(fmt::format("{0} = {0} + {1} * {2}", value, left, right), depth + 1);
    return value;
  }

  WarpRow short_product(const std::vector<std::string>& of, const Matrix& matrix, int bits) {
    WarpRow result;
    for (std::size_t j = 0; j < matrix.columns; ++j) {
      std::string value;
      for (std::size_t i = 0; i < matrix.rows; ++i) {
        const std::optional<std::string> text = literal(matrix(i, j), bits);
        const std::string factor = text ? *text
                                        : bound(fmt::format("table_{}", bits),
                                                table(bits).add(Matrix(1, 1, matrix(i, j))));
        const std::string next = fresh("v");
        line(i == 0 ? fmt::format("{} = {} * {}", next, of[i], factor)
                    : fmt::format("{} = {} + {} * {}", next, value, of[i], factor));
        value = next;
      }
      result.columns.push_back(value);
    }
    return result;
  }

  WarpRow interpolated_of(const WarpNode& node) {
    const Matrix& knots = graph_.nodes[node.operands[1]].values;
    const Matrix& values = graph_.nodes[node.operands[2]].values;
    const int bits = types_.bits(node.type);
    const std::string table_name = fmt::format("table_{}", bits);
    const std::string x = column(node.operands[0], 0);
    const std::size_t at_knots = table(bits).add(knots);
    const std::size_t at_values = table(bits).add(values);
    const std::string search =
        called("cell", bits,
               {x, table_name, std::to_string(at_knots), std::to_string(knots.values.size() - 1)});
    // Tables over the same knots have one search.
    const auto [known, is_new] = cells_.try_emplace(search);
    if (is_new) {
      known->second = fresh("j");
      line(fmt::format("{} = {}", known->second, search));
    }
    const std::string& cell = known->second;
    const std::string left = fresh("v");
    const std::string right = fresh("v");
    std::string share = fresh("v");
    line(fmt::format("{} = {}[{} + {}]", left, table_name, at_knots, cell));
    line(fmt::format("{} = {}[{} + {}]", right, table_name, at_knots + 1, cell));
    line(fmt::format("{0} = ({1} - {2}) / ({3} - {2})", share, x, left, right));
    if (node.operation == WarpOperation::held_interpolation) {
      const std::string held = fresh("v");
      const std::string above = called("higher", bits, {share, *literal(0.0, bits)});
      line(fmt::format("{} = {}", held, called("lower", bits, {above, *literal(1.0, bits)})));
      share = held;
    }
    WarpRow result;
    for (std::size_t j = 0; j < node.width; ++j) {
      const std::string from = fresh("v");
      const std::string to = fresh("v");
      line(fmt::format("{} = {}[{} + {} * {}]", from, table_name, at_values + j, cell, node.width));
      line(fmt::format("{} = {}[{} + {} * {}]", to, table_name, at_values + node.width + j, cell,
                       node.width));
      result.columns.push_back(fresh("v"));
      line(fmt::format("{0} = {1} + ({2} - {1}) * {3}", result.columns.back(), from, to, share));
    }
    return result;
  }

  void add_results() {
    line("value[i] = " + column(graph_.value, 0));
    line("std_dev[i] = " + column(graph_.std_dev, 0));
    line(fmt::format("fault[i] = wp.int32({})", column(graph_.fault, 0)));
  }

  /// All statements that read the state come before those that write it.
  void add_next_state() {
    const WarpNode& node = graph_.nodes[graph_.next_state];
    const std::vector<WarpIndex> parts = node.operation == WarpOperation::joined
                                             ? node.operands
                                             : std::vector<WarpIndex>{graph_.next_state};
    for (const WarpIndex part : parts) {
      const WarpRow own = row(part);
      if (own.array != "state" || width_of(part) <= kUnrolledWidth) {
        if (width_of(part) <= kUnrolledWidth) (void)all_columns(part);
        continue;
      }
      const WarpRow safe = room(bits_of(part), width_of(part));
      copy(part, safe.array, safe.first);
      rows_[part] = safe;
    }
    std::size_t place = 0;
    for (const WarpIndex part : parts) {
      copy(part, "state", place);
      place += width_of(part);
    }
  }

  const StepGraph& graph_;
  WarpTypes types_;
  std::vector<WarpRow> rows_;
  std::string text_;
  WarpTable table_32_{32};
  WarpTable table_64_{64};
  std::map<std::pair<std::string, std::size_t>, std::string> bound_;
  std::map<WarpIndex, WarpRow> copies_;
  std::map<std::string, std::string> cells_;  ///< variables, by their search
  std::size_t work_32_ = 0;
  std::size_t work_64_ = 0;
  std::size_t names_ = 0;
  bool has_functions_32_ = false;
  bool has_functions_64_ = false;
};

}  // namespace

std::string warp_kernel_text(const ModelFile& model, const WarpKernelOptions& options,
                             const std::string& origin) {
  const StepGraph graph = step_graph(model, {.precision = options.precision});
  return warp_module(graph, WarpWriter(graph).parts(), options, origin);
}

}  // namespace torsio
