#include "torsio/model/gru.hpp"

#include <utility>

namespace torsio {

Gru::Gru(Parameters parameters)
    : parameters_(std::move(parameters)), network_(parameters_, 1, kFamily) {}

}  // namespace torsio
