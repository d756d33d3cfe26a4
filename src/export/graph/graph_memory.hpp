#pragma once

#include <vector>

#include "estimate/guard_listing.hpp"
#include "export/graph/graph_builder.hpp"

namespace torsio {

/// `detail::MemoryError` in a graph: each change of it takes place where a truth holds. A member has the name of the one
/// there; what is infinite there after a reset has a truth beside it.
class GraphMemory {
 public:
  /// Within a scope of the builder.
  GraphMemory(GraphBuilder& graph, const GuardListing& guards);

  /// @param ticks a constant is 1
  void interrupt(Row where, Row ticks, Row share, bool others);
  void doubt(Row where, Row ticks, Row share);
  void miss_others(Row where, Row missed);
  void lose(Row where);
  void follow(Row where, Row x);

  [[nodiscard]] Row is_open() const { return is_open_; }
  /// The bound; infinite where there is none.
  [[nodiscard]] Row bound() const;
  void store();

 private:
  [[nodiscard]] std::vector<std::size_t> slips_of(bool first) const;
  void raise_share(Row where, Row ticks, Row towards);
  void lose_travel(Row where, Row share, bool others);
  [[nodiscard]] Row others_left() const;
  /// One of `values` for each relaxation or slip, by its input.
  [[nodiscard]] Row by_relaxation(Row of_first, Row of_others) const;

  GraphBuilder& graph_;
  const GuardListing& guards_;
  std::vector<std::size_t> first_slips_;
  std::vector<std::size_t> other_slips_;
  bool has_warm_up_ = false;
  Row is_open_;
  Row share_ = {};  ///< per relaxation
  Row unknown_travel_ = {};
  Row travel_before_ = {};
  Row lowest_ = {};
  Row highest_ = {};
  Row has_range_ = {};
  Row others_position_ = {};  ///< per slip over another input
  Row others_lowest_ = {};
  Row others_highest_ = {};
  Row others_unknown_ = {};
  Row others_have_range_ = {};  ///< real numbers, 0 or 1
  Row ticks_left_ = {};
};

}  // namespace torsio
