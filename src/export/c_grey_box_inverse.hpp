#pragma once

#include "export/c_text.hpp"
#include "model/grey_box/grey_box.hpp"

namespace torsio {

/// Writes `NAME_invert_model` for a grey box whose coefficients do not depend on its first input. After `write_grey_box`.
void write_grey_box_inverse(CText& c, const GreyBox::Parameters& parameters);

}  // namespace torsio
