#pragma once

#include <string_view>

// The bundle of web/, which the build puts into the library (cmake/embed_page_files.cmake).
namespace torsio {

[[nodiscard]] std::string_view page_script() noexcept;
[[nodiscard]] std::string_view page_style() noexcept;

}  // namespace torsio
