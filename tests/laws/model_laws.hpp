#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/dump.hpp"
#include "support/every_family.hpp"
#include "support/example_models.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/any_model.hpp"

/// The definition of a model family. A new one of `AllFamilies` specialises `example`
/// (support/examples); the laws are then tested for it without another line.
///
/// Laws of fitters are in fit_laws_test.cpp. That NaN in gives a fault and a finite value out, and
/// that offline equals streaming, are laws of the estimator; that saving and loading changes no bit
/// is one of the model files.
namespace torsio::test {

template <class M>
std::vector<double> values(M& model, const Matrix& features) {
  std::vector<double> all;
  for (std::size_t n = 0; n < features.rows; ++n) all.push_back(model.step(features.row(n)).value);
  return all;
}

template <class M>
class ModelLaws : public testing::Test {
 protected:
  static constexpr std::size_t kSamples = 400;

  M model_ = example<M>();
  Matrix features_ = example_features(kSamples, model_.input_count());
};

}  // namespace torsio::test
