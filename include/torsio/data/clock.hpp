#pragma once

#include "torsio/core/error.hpp"

namespace torsio {

/// The stamps of a log make no uniform clock; the advice names the mapping line that mends them.
class ClockError : public Error {
 public:
  using Error::Error;
};

}  // namespace torsio
