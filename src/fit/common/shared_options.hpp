#pragma once

#include "torsio/fit/common/options.hpp"

namespace torsio {

/// Options of all families whose coefficients are solved for linearly.
inline constexpr OptionInfo kRatesOption{.name = "rates",
                                         .help = "give inputs that are rates a slope too"};
inline constexpr OptionInfo kScheduleOption{
    .name = "schedule",
    .help = "input over whose distinct training values all coefficients are interpolated"};

}  // namespace torsio
