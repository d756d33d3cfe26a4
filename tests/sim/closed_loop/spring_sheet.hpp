#pragma once

#include "torsio/actuator/data_sheet.hpp"

namespace torsio::test {

/// The joint that these loops control.
inline const DataSheet kSheet = data_sheet("dfki-50");

}  // namespace torsio::test
