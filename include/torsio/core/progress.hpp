#pragma once

#include <functional>
#include <string_view>

namespace torsio {

/// Told by long work how far it is: a fraction in 0..1 and what it is at. It returns false to ask
/// the work to stop, which the work does by throwing `Cancelled`. An empty function means that
/// nobody listens.
using Progress = std::function<bool(double fraction, std::string_view doing)>;

}  // namespace torsio
