#pragma once

#include "model/viscoelastic/spring_dashpot_network.hpp"

namespace torsio {

/// The same network with its interchangeable parts in a fixed order: networks of one shape that are
/// joined side by side swap their values until those of the shortest time (sum of d over sum of k)
/// come first. Parts without springs or without dashpots stay as they are.
[[nodiscard]] SpringDashpotNetwork fastest_first(SpringDashpotNetwork network);

}  // namespace torsio
