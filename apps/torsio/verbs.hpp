#pragma once

#include <CLI/App.hpp>

/// One function per verb: it declares the sub-command's flags and its action. Verbs throw
/// `torsio::Error`; main turns that into a message and an exit code (0 success, 1 the work failed,
/// 2 the call was wrong).
void add_simulate(CLI::App& app);
void add_arm(CLI::App& app);
void add_joint(CLI::App& app);
void add_check(CLI::App& app);
void add_fit(CLI::App& app);
void add_identify(CLI::App& app);
void add_drift(CLI::App& app);
void add_estimate(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_compare(CLI::App& app);
void add_search(CLI::App& app);
void add_fleet(CLI::App& app);
void add_work(CLI::App& app);
void add_store(CLI::App& app);
void add_convert(CLI::App& app);
void add_crossvalidate(CLI::App& app);
void add_demo(CLI::App& app);
void add_map(CLI::App& app);
void add_adapt(CLI::App& app);
void add_attribute(CLI::App& app);
void add_import(CLI::App& app);
void add_export(CLI::App& app);
void add_monitor(CLI::App& app);
void add_track(CLI::App& app);
void add_transfer(CLI::App& app);
void add_tune_loop(CLI::App& app);
void add_design(CLI::App& app);
void add_connect(CLI::App& app);
void add_reproduce(CLI::App& app);
void add_unpack(CLI::App& app);
void add_bench(CLI::App& app);
void add_doctor(CLI::App& app);
