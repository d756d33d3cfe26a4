#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(Mlp, ModelLaws, Mlp);
INSTANTIATE_TYPED_TEST_SUITE_P(Lstm, ModelLaws, Lstm);
INSTANTIATE_TYPED_TEST_SUITE_P(Gru, ModelLaws, Gru);

}  // namespace torsio::test
