#pragma once

#include "support/examples/gaussian_process.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/hammerstein_wiener.hpp"
#include "support/examples/hysteresis.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/mixture.hpp"
#include "support/examples/narx.hpp"
#include "support/examples/network.hpp"
#include "support/examples/second_order.hpp"
#include "support/examples/viscoelastic.hpp"
#include "torsio/model/any_model.hpp"

/// The examples of all families, for the laws: one header a room of `src/model`.
namespace torsio::test {

template <>
inline AnyModel example<AnyModel>() {
  return example<Polynomial>();
}

}  // namespace torsio::test
