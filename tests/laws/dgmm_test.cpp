#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(Dgmm, ModelLaws, Dgmm);
INSTANTIATE_TYPED_TEST_SUITE_P(Dgmm, InverseLaws, Dgmm);

}  // namespace torsio::test
