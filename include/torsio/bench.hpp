#pragma once

// Start here without a bench: recordings of simulated actuators.
//
//   DataSheet        the values of an actuator, each with its source
//   find_data_sheet  a built-in sheet by name, or one of your own in YAML
//   ExperimentSpec   what to simulate: experiment, duration, seed, faults, temperature
//   simulate         its recording
//   FaultSchedule    faults of sensors and parts, each with its time

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"
