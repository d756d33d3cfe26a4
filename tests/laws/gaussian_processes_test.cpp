#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(GaussianProcess, ModelLaws, GaussianProcess);
INSTANTIATE_TYPED_TEST_SUITE_P(ParametricGp, ModelLaws, ParametricGp);

}  // namespace torsio::test
