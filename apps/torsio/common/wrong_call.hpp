#pragma once

#include <CLI/App.hpp>
#include <string>

/// The message for an unknown verb or option, with the nearest known name; empty
/// if the call is wrong in another way.
[[nodiscard]] std::string unknown_name(const CLI::App& app, int argc, char** argv);
