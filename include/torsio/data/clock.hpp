#pragma once

#include "torsio/core/error.hpp"

namespace torsio {

/// The time stamps of a log are not uniform; the advice gives the mapping line that corrects them.
class ClockError : public Error {
 public:
  using Error::Error;
};

}  // namespace torsio
