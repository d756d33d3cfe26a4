#pragma once

// Start here to learn a model from recordings.
//
//   check_dataset   whether a model can be learned from them
//   resolve_inputs  the inputs of a model
//   train_model     one fitted model with its guards: a `ModelFile`; `families()` lists the families
//   evaluate        its scores in free run
//   compare         many models, ranked on held-out recordings

#include "torsio/check/check.hpp"
#include "torsio/data/load.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"
#include "torsio/fit/train_model.hpp"
