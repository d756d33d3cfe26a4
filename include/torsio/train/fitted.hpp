#pragma once

#include <string>
#include <vector>

namespace torsio {

/// What a fitter returns: the parameters, and what the user should be told about them ("input
/// support_m is constant in the training data: no term").
template <class Family>
struct Fitted {
  typename Family::Parameters parameters;
  std::vector<std::string> notes;
};

}  // namespace torsio
