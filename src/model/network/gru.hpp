#pragma once

#include "model/network/recurrent_model.hpp"

namespace torsio {

/// GRU layers, then dense ones. Source: specification 3.4.
using Gru = RecurrentModel<GruLayer>;

}  // namespace torsio
