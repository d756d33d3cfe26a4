#pragma once

#include "model/network/recurrent_model.hpp"

namespace torsio {

/// LSTM layers, then dense ones. Source: paper 004, specification 3.4.
using Lstm = RecurrentModel<LstmLayer>;

}  // namespace torsio
