#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(DynamicBoucWen, ModelLaws, DynamicBoucWen);
INSTANTIATE_TYPED_TEST_SUITE_P(FrictionDrive, ModelLaws, FrictionDrive);

}  // namespace torsio::test
