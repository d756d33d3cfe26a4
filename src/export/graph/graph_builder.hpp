#pragma once

#include <cstddef>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/export/step_graph.hpp"

namespace torsio {

class GraphBuilder;

/// The value of a node while a graph is built.
struct Row {
  GraphBuilder* graph = nullptr;
  StepGraph::Index index = 0;

  [[nodiscard]] std::size_t width() const;
  [[nodiscard]] bool is_constant() const;
  /// Some of its columns.
  [[nodiscard]] Row part(std::size_t first, std::size_t count = 1) const;
};

/// Adds nodes; equal ones are one.
class GraphBuilder {
 public:
  explicit GraphBuilder(GraphPrecision precision);

  /// Whether the constants and states that follow are wide numbers.
  void use_wide(bool is_wide) noexcept { is_wide_ = is_wide; }

  Row input(std::size_t width);
  Row timestep();
  Row constant(double value);
  Row constant(std::span<const double> values);
  Row constant(Matrix values);
  Row constant(Matrix values, StepGraph::Type type);
  Row single_constant(Matrix values);
  Row truth(bool value);
  Row node(GraphOperation operation, StepGraph::Type type, std::size_t width,
           std::vector<StepGraph::Index> operands, std::size_t first = 0);

  /// States beside each other.
  struct Scope {
    StepGraph::Index before = 0;   ///< its part of the state
    StepGraph::Index cleared = 0;  ///< the same, 0 where it restarts
    StepGraph::Index read = 0;     ///< the same as numbers of its type
    std::size_t first = 0;         ///< column of the state
    std::size_t first_part = 0;    ///< index of its first named state
    std::size_t end_part = 0;
  };

  /// The states from here to `end_scope` are read as 0 where `restarts` is true.
  void begin_scope(Row restarts);
  Scope end_scope();
  /// All states of the scope have been set. Where `keeps` is true they are those before this tick, also where it restarted;
  /// where `clears` is true they are 0. Scopes are finished in any order.
  void finish(const Scope& scope, Row keeps, Row clears);

  /// A state before this tick, within a scope.
  Row state(const std::string& name, std::size_t width = 1);
  Row truth_state(const std::string& name);
  void set_state(const std::string& name, Row next);

  Row as_type(Row row, StepGraph::Type type);
  /// As a number of the type that constants have now.
  Row as_number(Row row) { return as_type(row, number_type()); }

  [[nodiscard]] const StepGraph::Node& at(StepGraph::Index index) const {
    return graph_.nodes[index];
  }

  /// The graph without the nodes that nothing depends on.
  [[nodiscard]] StepGraph finished(Row value, Row std_dev, Row fault);

 private:
  Row added(StepGraph::Node node, const std::string& key);
  [[nodiscard]] StepGraph::Type state_type() const noexcept;
  [[nodiscard]] StepGraph::Type number_type() const noexcept;

  StepGraph graph_;
  std::map<std::string, StepGraph::Index> known_;
  std::map<std::string, StepGraph::Index> next_;
  std::map<std::size_t, StepGraph::Index> finished_;  ///< next states, by the column of their scope
  bool is_wide_ = false;
  Scope scope_;
};

Row operator+(Row a, Row b);
Row operator-(Row a, Row b);
Row operator*(Row a, Row b);
Row operator/(Row a, Row b);
Row operator<(Row a, Row b);
Row operator<=(Row a, Row b);
Row operator+(Row a, double b);
Row operator-(Row a, double b);
Row operator*(Row a, double b);
Row operator<(Row a, double b);
Row operator<=(Row a, double b);
Row operator-(double a, Row b);
Row operator<(double a, Row b);
Row operator-(Row a);

Row minimum(Row a, Row b);
Row maximum(Row a, Row b);
Row minimum(Row a, double b);
Row maximum(Row a, double b);
Row power(Row a, Row b);
Row absolute(Row a);
Row square_root(Row a);
Row exponential(Row a);
Row tangent(Row a);
Row sigmoid(Row a);
Row limited(Row a, Row lowest, Row highest);
Row limited(Row a, double lowest, double highest);
Row both(Row a, Row b);
Row either(Row a, Row b);
Row is_not(Row a);
Row select(Row where, Row yes, Row no);
Row select(Row where, Row yes, double no);
Row select(Row where, double yes, Row no);
Row select(Row where, double yes, double no);
Row is_finite(Row a);
/// Whether all columns are.
Row all_finite(Row a);
Row product(Row a, Row matrix);
Row sum(Row a);
/// The largest column.
Row largest(Row a);
/// sum_j a_j b_j
Row dot(Row a, Row b);
Row to_real(Row a);
Row to_single(Row a);
Row joined(std::span<const Row> rows);
/// sqrt(a^2 + b^2)
Row hypotenuse(Row a, Row b);
/// The rows of `table` between the knots; @param is_held beyond their ends
Row interpolated(Row x, std::span<const double> knots, Row table, bool is_held);

}  // namespace torsio
