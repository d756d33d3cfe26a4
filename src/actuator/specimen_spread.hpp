#pragma once

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Changes the nominal sheet to that of the specimen with its serial number; without one it is not
/// changed.
///
/// Each of these is drawn once, uniformly, from a generator seeded by the actuator's base name and
/// the serial number, so that all variants of a specimen have the same draws: stiffness of spring,
/// coupling, rubber or tube +-3 % (all stiffnesses of one together), inner friction +-25 %,
/// backlash +-50 %, asymmetry +-0.03 (added), Coulomb friction of gear and bearing +-20 %, and the
/// zero of each encoder +-0.02 deg. Gears and the clutch, whose preload is set on the bench, are
/// nominal. Source: specification 4.6.
void spread_specimen(DataSheet& sheet);

}  // namespace torsio
