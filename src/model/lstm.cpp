#include "torsio/model/lstm.hpp"

namespace torsio {

Lstm::Lstm(const Parameters& parameters)
    : parameters_(parameters), network_(parameters_, 1, kFamily) {}

}  // namespace torsio
