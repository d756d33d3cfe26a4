#pragma once

#include "export/c_text.hpp"
#include "model/grey_box/grey_box.hpp"

namespace torsio {

/// The functions of `write_model` for a grey box. @throws UsageError for one whose residual is a mixture.
void write_grey_box(CText& c, const GreyBox::Parameters& parameters);

}  // namespace torsio
