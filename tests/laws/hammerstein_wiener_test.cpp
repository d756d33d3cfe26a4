#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(HammersteinWiener, ModelLaws, HammersteinWiener);

}  // namespace torsio::test
