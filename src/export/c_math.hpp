#pragma once

#include <span>
#include <string_view>

#include "export/c_text.hpp"

namespace torsio {

/// A function of the C file in the place of one of a C library; both are templates of `CText`.
struct CMathFunction {
  std::string_view call;  ///< how a call begins: "@square_root("
  std::string_view text;
};

/// All functions, each after those that it calls. Relative errors of the float variants: about 2e-7; of the double ones:
/// about 1e-15, but `hyperbolic_tangent` 2.1e-8, as the networks have.
[[nodiscard]] std::span<const CMathFunction> c_math(CReal real);

}  // namespace torsio
