#pragma once

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "support/examples/example.hpp"

namespace torsio::test {

/// Two sections; of the two inputs it uses the first.
template <>
inline HammersteinWiener example<HammersteinWiener>() {
  HammersteinWiener::Parameters parameters = hammerstein_wiener_of(Paper003::discrete, 2);
  parameters.sample_period_s = 1e-3;
  parameters.rest_input = 0.01;
  parameters.input = {.knots = {-0.1, 0.0, 0.1}, .values = {-1.2, 0.0, 1.0}};
  parameters.sections = sections_of({{1.0, -0.7, 0.2, 0.1}, {1.0, -1.5, 0.8, -0.2}});
  parameters.output = {.knots = {}, .values = {0.2, 20.0, 0.4, 0.1}};
  parameters.lowest = -8.0;
  parameters.highest = 8.0;
  return HammersteinWiener(parameters);
}

}  // namespace torsio::test
