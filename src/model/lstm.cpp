#include "torsio/model/lstm.hpp"

#include <utility>

namespace torsio {

Lstm::Lstm(Parameters parameters)
    : parameters_(std::move(parameters)), network_(parameters_, 1, kFamily) {}

}  // namespace torsio
