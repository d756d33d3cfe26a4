#pragma once

#include "torsio/model/recurrent_model.hpp"

namespace torsio {

/// LSTM layers, then dense ones. Source: paper 004, SPEC section 3.4.
using Lstm = RecurrentModel<LstmLayer>;

}  // namespace torsio
