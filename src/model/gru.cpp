#include "torsio/model/gru.hpp"

namespace torsio {

Gru::Gru(const Parameters& parameters)
    : parameters_(parameters), network_(parameters_, 1, kFamily) {}

}  // namespace torsio
