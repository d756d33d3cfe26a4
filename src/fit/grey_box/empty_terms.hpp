#pragma once

#include "model/grey_box/grey_box.hpp"

namespace torsio {

/// The same box without slip elements and branches whose coefficients are all 0, as bounds often make them: each would
/// take time in every step. Beside a residual, all slip elements stay, since they are its inputs.
[[nodiscard]] GreyBox::Parameters without_empty_terms(GreyBox::Parameters box);

}  // namespace torsio
