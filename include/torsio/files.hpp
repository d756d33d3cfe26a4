#pragma once

// Start here for model files: loading may throw and allocates, so it belongs before the loop.
//
//   load_estimator  an `Estimator` from a model file, ready to step
//   ModelFile       a model with its features, guards and card
//   load_model      a `ModelFile`, for its card or to change it
//   save_model      writes one completely or not at all
//   load_monitor    a `MonitoredTorque` from the file of a monitor

#include "torsio/files/model_file.hpp"
#include "torsio/files/monitor_file.hpp"
