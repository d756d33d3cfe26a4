#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(Viscoelastic, ModelLaws, Viscoelastic);
INSTANTIATE_TYPED_TEST_SUITE_P(Viscoelastic, InverseLaws, Viscoelastic);

}  // namespace torsio::test
