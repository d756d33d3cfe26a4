#pragma once

#include <string_view>

namespace torsio {

/// The bundle of web/ for the page of joints, compiled in.
[[nodiscard]] std::string_view live_script() noexcept;
[[nodiscard]] std::string_view live_style() noexcept;
[[nodiscard]] std::string_view live_html() noexcept;

}  // namespace torsio
