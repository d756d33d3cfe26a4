#pragma once

#include <CLI/App.hpp>
#include <string>

/// A script that completes the verbs and options of a program for bash, zsh or fish, made from the same
/// declarations as its help. @throws torsio::UsageError for another shell.
[[nodiscard]] std::string completion_script(const CLI::App& app, const std::string& shell);
