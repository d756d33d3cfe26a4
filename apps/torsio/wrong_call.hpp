#pragma once

#include <CLI/App.hpp>
#include <string>

/// What to say of a verb or an option that there is not, with the nearest name that there is; empty
/// where the call is wrong in another way.
[[nodiscard]] std::string unknown_name(const CLI::App& app, int argc, char** argv);
