#include "torsio/core/fault.hpp"

namespace torsio {

std::string_view name(Fault fault) noexcept {
  switch (fault) {
    case Fault::none: return "none";
    case Fault::input_not_finite: return "input_not_finite";
    case Fault::input_count_wrong: return "input_count_wrong";
    case Fault::warming_up: return "warming_up";
    case Fault::zero_not_set: return "zero_not_set";
    case Fault::outside_training_range: return "outside_training_range";
    case Fault::recovering: return "recovering";
    case Fault::wrong_rate: return "wrong_rate";
    case Fault::model_not_finite: return "model_not_finite";
    case Fault::diverged: return "diverged";
  }
  return "unknown";
}

}  // namespace torsio
