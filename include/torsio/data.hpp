#pragma once

// Start here for recordings.
//
//   load_dataset     recordings or manifests with mapping, units, clock and splits
//   Dataset          recordings with the roles of their samples: train, validation, test
//   Recording        channels in SI at one rate
//   Mapping          names, units, signs, zeros and clock of the logs of other programs
//   write_recording  a recording as CSV, MCAP, .npz or .mat

#include "torsio/data/dataset.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/data/write.hpp"
#include "torsio/joint_load/known_load.hpp"
