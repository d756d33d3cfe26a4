#include "fit/viscoelastic/network_order.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace torsio {
namespace {

/// A part of a network: its nodes from begin to end.
struct Part {
  std::size_t begin = 0;
  std::size_t end = 0;
};

bool have_one_shape(const SpringDashpotNetwork& network, const Part& a, const Part& b) {
  if (a.end - a.begin != b.end - b.begin) return false;
  for (std::size_t i = 0; i < a.end - a.begin; ++i) {
    const NetworkNode& left = network.nodes[a.begin + i];
    const NetworkNode& right = network.nodes[b.begin + i];
    if (left.kind != right.kind || left.children != right.children) return false;
  }
  return true;
}

double sum_of(const SpringDashpotNetwork& network, const Part& part, NetworkKind kind) {
  double sum = 0.0;
  for (std::size_t i = part.begin; i < part.end; ++i)
    if (network.nodes[i].is(kind)) sum += network.nodes[i].value;
  return sum;
}

void swap_values(SpringDashpotNetwork& network, const Part& a, const Part& b) {
  for (std::size_t i = 0; i < a.end - a.begin; ++i)
    std::swap(network.nodes[a.begin + i].value, network.nodes[b.begin + i].value);
}

void order(SpringDashpotNetwork& network, const std::vector<Part>& children) {
  const auto time = [&](const Part& part) {
    return sum_of(network, part, NetworkKind::dashpot) / sum_of(network, part, NetworkKind::spring);
  };
  const auto is_timed = [&](const Part& part) {
    return sum_of(network, part, NetworkKind::dashpot) > 0.0 &&
           sum_of(network, part, NetworkKind::spring) > 0.0;
  };
  for (std::size_t i = 0; i < children.size(); ++i)
    for (std::size_t j = i + 1; j < children.size(); ++j)
      if (have_one_shape(network, children[i], children[j]) && is_timed(children[i]) &&
          time(children[j]) < time(children[i]))
        swap_values(network, children[i], children[j]);
}

}  // namespace

SpringDashpotNetwork fastest_first(SpringDashpotNetwork network) {
  std::vector<Part> open;
  for (std::size_t i = 0; i < network.nodes.size(); ++i) {
    const NetworkNode& node = network.nodes[i];
    if (node.is_leaf()) {
      open.push_back({i, i + 1});
      continue;
    }
    const auto first = open.end() - static_cast<std::ptrdiff_t>(node.children);
    const std::vector<Part> children(first, open.end());
    open.erase(first, open.end());
    order(network, children);
    open.push_back({children.front().begin, i + 1});
  }
  return network;
}

}  // namespace torsio
