#include "export/graph/graph_memory.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace torsio {
namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();
/// Per unit of an input whose range has no width: each part of it is more than all.
constexpr double kAlways = 1e30;

}  // namespace

GraphMemory::GraphMemory(GraphBuilder& graph, const GuardListing& guards)
    : graph_(graph),
      guards_(guards),
      first_slips_(slips_of(true)),
      other_slips_(slips_of(false)),
      has_warm_up_(!guards.memory.is_declared && std::isfinite(guards.warm_up_ticks)),
      is_open_(graph.truth_state("memory_is_open")) {
  if (!guards_.decay.empty()) share_ = graph_.state("share", guards_.decay.size());
  if (!first_slips_.empty()) {
    unknown_travel_ = graph_.state("unknown_travel");
    travel_before_ = graph_.state("travel_before");
    lowest_ = graph_.state("lowest");
    highest_ = graph_.state("highest");
    has_range_ = graph_.truth_state("has_range");
  }
  if (const std::size_t count = other_slips_.size(); count > 0) {
    others_position_ = graph_.state("others_position", count);
    others_lowest_ = graph_.state("others_lowest", count);
    others_highest_ = graph_.state("others_highest", count);
    others_unknown_ = graph_.state("others_unknown", count);
    others_have_range_ = graph_.state("others_have_range", count);
  }
  if (has_warm_up_) ticks_left_ = graph_.state("ticks_left");
}

void GraphMemory::store() {
  graph_.set_state("memory_is_open", is_open_);
  if (!guards_.decay.empty()) graph_.set_state("share", share_);
  if (!first_slips_.empty()) {
    graph_.set_state("unknown_travel", unknown_travel_);
    graph_.set_state("travel_before", travel_before_);
    graph_.set_state("lowest", lowest_);
    graph_.set_state("highest", highest_);
    graph_.set_state("has_range", has_range_);
  }
  if (!other_slips_.empty()) {
    graph_.set_state("others_position", others_position_);
    graph_.set_state("others_lowest", others_lowest_);
    graph_.set_state("others_highest", others_highest_);
    graph_.set_state("others_unknown", others_unknown_);
    graph_.set_state("others_have_range", others_have_range_);
  }
  if (has_warm_up_) graph_.set_state("ticks_left", ticks_left_);
}

std::vector<std::size_t> GraphMemory::slips_of(bool first) const {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < guards_.memory.slips.size(); ++i)
    if ((guards_.memory.slips[i].input == 0) == first) indices.push_back(i);
  return indices;
}

Row GraphMemory::by_relaxation(Row of_first, Row of_others) const {
  std::vector<double> is_first;
  for (const Relaxation& each : guards_.memory.relaxations)
    is_first.push_back(each.input == 0 ? 1.0 : 0.0);
  if (std::ranges::count(is_first, 1.0) == std::ssize(is_first)) return of_first;
  return select(0.5 < graph_.constant(is_first), of_first, of_others);
}

void GraphMemory::raise_share(Row where, Row ticks, Row towards) {
  if (guards_.decay.empty()) return;
  const Row decay = graph_.constant(guards_.decay);
  const Row kept = ticks.is_constant() ? decay : power(decay, ticks);
  const Row raised = towards - (towards - share_) * kept;
  share_ = select(both(where, share_ < towards), raised, share_);
}

void GraphMemory::lose_travel(Row where, Row share, bool others) {
  if (!first_slips_.empty()) {
    const Row left = maximum(unknown_travel_ - (highest_ - lowest_), 0.0);
    const Row begins = both(where, has_range_);
    travel_before_ = select(begins, left, travel_before_);
    unknown_travel_ = select(begins, left, unknown_travel_);
    const double width = guards_.first_width;
    unknown_travel_ =
        select(where, minimum(maximum(unknown_travel_, travel_before_ + share * width), width),
               unknown_travel_);
    has_range_ = both(has_range_, is_not(where));
  }
  if (others && !other_slips_.empty()) {
    std::vector<double> travel;
    for (const std::size_t i : other_slips_) travel.push_back(guards_.memory.slips[i].travel);
    others_position_ = select(where, 0.0, others_position_);
    others_have_range_ = select(where, 0.0, others_have_range_);
    others_unknown_ = select(where, graph_.constant(travel), others_unknown_);
  }
  if (has_warm_up_) ticks_left_ = select(where, guards_.warm_up_ticks, ticks_left_);
  is_open_ = either(is_open_, where);
}

void GraphMemory::interrupt(Row where, Row ticks, Row share, bool others) {
  if (!guards_.decay.empty()) {
    const Row one = graph_.constant(1.0);
    raise_share(where, ticks, others ? one : by_relaxation(share, graph_.constant(0.0)));
  }
  lose_travel(where, share, others);
}

void GraphMemory::doubt(Row where, Row ticks, Row share) {
  const Row at_most_one = minimum(share, 1.0);
  if (!guards_.decay.empty()) raise_share(where, ticks, by_relaxation(share, at_most_one));
  lose_travel(where, at_most_one, true);
}

void GraphMemory::lose(Row where) {
  if (!guards_.decay.empty()) share_ = select(where, 1.0, share_);
  interrupt(where, graph_.constant(1.0), graph_.constant(1.0), true);
}

Row GraphMemory::others_left() const {
  const Row covered = select(0.5 < others_have_range_, others_highest_ - others_lowest_, 0.0);
  return maximum(others_unknown_ - covered, 0.0);
}

void GraphMemory::miss_others(Row where, Row missed) {
  const auto& relaxations = guards_.memory.relaxations;
  const bool has_relaxation =
      std::ranges::any_of(relaxations, [](const Relaxation& each) { return each.input > 0; });
  if (!has_relaxation && other_slips_.empty()) return;
  if (has_relaxation) {
    // What each relaxation has missed, as a share of the width of its input.
    Matrix shares(missed.width(), relaxations.size());
    for (std::size_t k = 0; k < relaxations.size(); ++k)
      if (const std::size_t input = relaxations[k].input; input > 0)
        shares(input, k) = guards_.widths[input] > 0.0 ? 1.0 / guards_.widths[input] : kAlways;
    const Row part = minimum(product(missed, graph_.constant(std::move(shares))), 1.0);
    share_ = select(where, maximum(share_, part), share_);
  }
  if (!other_slips_.empty()) {
    Matrix inputs(missed.width(), other_slips_.size());
    std::vector<double> period_s;
    std::vector<double> travel;
    for (std::size_t i = 0; i < other_slips_.size(); ++i) {
      const SlipMemory& slip = guards_.memory.slips[other_slips_[i]];
      inputs(slip.input, i) = 1.0;
      period_s.push_back(slip.period_s);
      travel.push_back(slip.travel);
    }
    const Row cut_off = product(missed, graph_.constant(std::move(inputs)));
    const Row periods = graph_.constant(period_s);
    const Row left = others_left();
    const Row unknown = select(0.0 < periods, left + periods * cut_off, maximum(left, cut_off));
    const Row changes = both(where, 0.0 < cut_off);
    others_unknown_ = select(changes, minimum(unknown, graph_.constant(travel)), others_unknown_);
    others_position_ = select(changes, 0.0, others_position_);
    others_have_range_ = select(changes, 0.0, others_have_range_);
  }
  is_open_ = either(is_open_, where);
}

void GraphMemory::follow(Row where, Row x) {
  const Row advances = both(where, is_open_);
  if (!guards_.decay.empty())
    share_ = select(advances, share_ * graph_.constant(guards_.decay), share_);
  if (!first_slips_.empty()) {
    const Row u = x.part(0);
    lowest_ = select(advances, select(has_range_, minimum(lowest_, u), u), lowest_);
    highest_ = select(advances, select(has_range_, maximum(highest_, u), u), highest_);
    has_range_ = either(has_range_, advances);
  }
  if (!other_slips_.empty()) {
    std::vector<double> period_s;
    std::vector<Row> inputs;
    for (const std::size_t i : other_slips_) {
      period_s.push_back(guards_.memory.slips[i].period_s);
      inputs.push_back(x.part(guards_.memory.slips[i].input));
    }
    const Row u = joined(inputs);
    const Row periods = graph_.constant(period_s);
    const Row position = select(0.0 < periods, others_position_ + periods * u, u);
    const Row has_range = 0.5 < others_have_range_;
    others_position_ = select(advances, position, others_position_);
    others_lowest_ = select(
        advances, select(has_range, minimum(others_lowest_, position), position), others_lowest_);
    others_highest_ = select(
        advances, select(has_range, maximum(others_highest_, position), position), others_highest_);
    others_have_range_ = select(advances, 1.0, others_have_range_);
  }
  if (has_warm_up_) ticks_left_ = select(advances, maximum(ticks_left_ - 1.0, 0.0), ticks_left_);
  const Row ends = both(advances, bound() <= guards_.negligible);
  if (!guards_.decay.empty()) share_ = select(ends, 0.0, share_);
  if (!first_slips_.empty()) {
    unknown_travel_ = select(ends, 0.0, unknown_travel_);
    travel_before_ = select(ends, 0.0, travel_before_);
    has_range_ = both(has_range_, is_not(ends));
  }
  if (!other_slips_.empty()) {
    others_position_ = select(ends, 0.0, others_position_);
    others_unknown_ = select(ends, 0.0, others_unknown_);
    others_have_range_ = select(ends, 0.0, others_have_range_);
  }
  is_open_ = both(is_open_, is_not(ends));
}

Row GraphMemory::bound() const {
  Row bound = graph_.constant(0.0);
  if (!guards_.memory.is_declared) {
    // Also where the time is not known.
    if (!has_warm_up_) return graph_.constant(kNoBound);
    return select(0.0 < ticks_left_, kNoBound, 0.0);
  }
  if (!guards_.decay.empty()) {
    std::vector<double> gain;
    for (const Relaxation& each : guards_.memory.relaxations) gain.push_back(each.gain);
    bound = bound + dot(share_, graph_.constant(gain));
  }
  if (!first_slips_.empty()) {
    std::vector<double> gain;
    std::vector<double> travel;
    for (const std::size_t i : first_slips_) {
      gain.push_back(guards_.memory.slips[i].gain);
      travel.push_back(std::min(guards_.memory.slips[i].travel, guards_.first_width));
    }
    const Row covered = select(has_range_, highest_ - lowest_, 0.0);
    const Row left = maximum(minimum(graph_.constant(travel), unknown_travel_) - covered, 0.0);
    bound = bound + dot(left, graph_.constant(gain));
  }
  if (!other_slips_.empty()) {
    std::vector<double> gain;
    for (const std::size_t i : other_slips_) gain.push_back(guards_.memory.slips[i].gain);
    bound = bound + dot(others_left(), graph_.constant(gain));
  }
  return bound;
}

}  // namespace torsio
