#pragma once

#include <CLI/App.hpp>
#include <string>

/// Writes the manual page of the program and one of each verb (torsio.1, torsio-fit.1, ...) into a
/// folder, from the help texts.
/// @throws torsio::Error if a page cannot be written.
void write_man_pages(const CLI::App& app, const std::string& folder);
