#pragma once

#include "model/viscoelastic/viscoelastic.hpp"
#include "support/examples/example.hpp"

namespace torsio::test {

/// Relaxes within 50 ms and 3 s.
template <>
inline Viscoelastic example<Viscoelastic>() {
  return Viscoelastic({.network = parse_network("series(kv(k1=900, d1=60), kv(k2=4000, d2=2000), "
                                                "parallel(k3=2500, maxwell(k4=300, d4=15)))"),
                       .offset = 0.5,
                       .sample_period_s = 1e-3,
                       .inputs = 2});
}

}  // namespace torsio::test
