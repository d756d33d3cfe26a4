#pragma once

#include <algorithm>
#include <cstddef>

#include "support/driven_record.hpp"
#include "support/example_data.hpp"
#include "torsio/fit/common/family_info.hpp"

namespace torsio::test {

/// `noisy_spring` recorded at two places of a support, the second with a stiffer spring.
inline TrainingData two_springs(std::size_t samples) {
  TrainingData data = noisy_spring(samples);
  data.inputs.push_back({.expression = "support_m"});
  data.sequences.push_back(data.sequences.front());
  for (std::size_t i = 0; i < data.sequences.size(); ++i) {
    Sequence& sequence = data.sequences[i];
    const Matrix two = sequence.features;
    sequence.features = Matrix(two.rows, 3);
    for (std::size_t n = 0; n < two.rows; ++n) {
      std::ranges::copy(two.row(n), sequence.features.row(n).begin());
      sequence.features(n, 2) = 0.1 * static_cast<double>(i);
      sequence.target[n] += 50.0 * static_cast<double>(i) * two(n, 0);
    }
  }
  return data;
}

/// A spring, or for families whose input is a force the motion that one of them made of it.
/// @param samples of a spring's record
inline TrainingData data_for(const FamilyInfo& family, std::size_t samples) {
  constexpr std::size_t kSamples = 600;
  if (family.model_family == DynamicBoucWen::kFamily)
    return recorded(hysteretic(), multisine(kSamples, 750.0, 5.0, 100.0, 60.0), 5e-6);
  if (family.model_family == RigidDrive::kFamily)
    return recorded(carriage(), multisine(kSamples, 1000.0, 2.0, 20.0, 200.0), 1e-6);
  return two_springs(samples);
}

}  // namespace torsio::test
