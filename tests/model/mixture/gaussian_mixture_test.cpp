#include "model/mixture/gaussian_mixture.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <functional>

#include "model/mixture/random_mixture.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::kNaN;

struct Damage {
  const char* message;
  std::function<void(GaussianMixture&)> act;
};

TEST(GaussianMixture, NamesTheComponentAndWhatIsWrongWithIt) {
  const std::vector<Damage> damages = {
      {"at least one component", [](auto& m) { m.weights.clear(); }},
      {"at least one quantity", [](auto& m) { m.centre.clear(); }},
      {"at most 64 quantities, found 65", [](auto& m) { m.centre.resize(65); }},
      {"scale: expected 4 values", [](auto& m) { m.scale.pop_back(); }},
      {"means: expected [5 x 4], found [5 x 3]", [](auto& m) { m.means = Matrix(5, 3); }},
      {"covariances: expected [5 x 16]", [](auto& m) { m.covariances = Matrix(4, 16); }},
      {"centre of quantity 2", [](auto& m) { m.centre[2] = kNaN; }},
      {"scale of quantity 1", [](auto& m) { m.scale[1] = 0.0; }},
      {"component 3: bad weight", [](auto& m) { m.weights[3] = -0.1; }},
      {"component 1: bad mean", [](auto& m) { m.means(1, 2) = kNaN; }},
      {"component 0: bad covariance; expected finite values",
       [](auto& m) { m.covariances(0, 5) = kNaN; }},
      {"component 4: bad covariance; expected a symmetric matrix",
       [](auto& m) { m.covariances(4, 1) += 0.1; }},
      {"component 2: bad covariance; expected a positive definite matrix",
       [](auto& m) { m.covariances(2, 10) *= -1.0; }},
      {"weights: expected a sum of 1", [](auto& m) { m.weights[0] += 0.5; }},
  };
  const GaussianMixture sound = test::random_mixture({.components = 5}, 1);
  EXPECT_NO_THROW(check(sound));
  for (const Damage& damage : damages) {
    GaussianMixture mixture = sound;
    damage.act(mixture);
    try {
      check(mixture);
      ADD_FAILURE() << "accepted, instead of: " << damage.message;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(damage.message));
    }
  }
}

}  // namespace
}  // namespace torsio
