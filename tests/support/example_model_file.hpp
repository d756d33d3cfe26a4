#pragma once

#include "support/example_settings.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {

/// A complete model file around a model of two inputs.
inline ModelFile example_model_file(const AnyModel& model) {
  return {.card = {.torsio_version = {},
                   .fitted_as = "by_hand",
                   .options = {{"degree", "3"}},
                   .seed = 18446744073709551615U,
                   .training_files = {{"sweep µ.csv", "0123abcd"}},
                   .zeros = {{"joint_angle_rad", 0.1, false}},
                   .held_out = "test: sweep_4",
                   .metrics = {{"rmse", 0.1}, {"fit_percent", 97.25}},
                   .device_serial = "elbow-7"},
          .settings = example_settings(),
          .parameters = model.parameters()};
}

}  // namespace torsio::test
