#pragma once

#include <cmath>
#include <cstddef>

#include "model/viscoelastic/spring_dashpot_network.hpp"
#include "torsio/core/random.hpp"

namespace torsio::test {

/// A network of up to three levels and 27 elements, the values spread evenly over the decades.
class RandomSpringDashpots {
 public:
  RandomSpringDashpots(Random& random, double lowest, double highest)
      : random_(random), lowest_(lowest), highest_(highest) {}

  SpringDashpotNetwork network() {
    add(random_.uniform() < 0.5, 3);
    return network_;
  }

 private:
  void add(bool is_series, int levels) {
    if (levels == 0 || random_.uniform() < 0.2) {
      const auto kind = static_cast<std::size_t>(random_.uniform() < 0.5 ? NetworkKind::spring
                                                                         : NetworkKind::dashpot);
      network_.nodes.push_back(
          {.kind = kind,
           .label = ++elements_,
           .value = lowest_ * std::pow(highest_ / lowest_, random_.uniform())});
      return;
    }
    const std::size_t children = random_.uniform() < 0.5 ? 2 : 3;
    for (std::size_t i = 0; i < children; ++i) add(!is_series, levels - 1);
    network_.nodes.push_back(
        {.kind = static_cast<std::size_t>(is_series ? NetworkKind::series : NetworkKind::parallel),
         .children = children});
  }

  Random& random_;
  double lowest_;
  double highest_;
  std::size_t elements_ = 0;
  SpringDashpotNetwork network_;
};

inline SpringDashpotNetwork random_spring_dashpots(Random& random, double lowest, double highest) {
  return RandomSpringDashpots(random, lowest, highest).network();
}

}  // namespace torsio::test
