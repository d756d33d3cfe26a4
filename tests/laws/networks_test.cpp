#include "laws/model_laws.hpp"
#include "model/network/ensemble.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(Mlp, ModelLaws, Mlp);
INSTANTIATE_TYPED_TEST_SUITE_P(Lstm, ModelLaws, Lstm);
INSTANTIATE_TYPED_TEST_SUITE_P(Gru, ModelLaws, Gru);
INSTANTIATE_TYPED_TEST_SUITE_P(MlpEnsemble, ModelLaws, MlpEnsemble);
INSTANTIATE_TYPED_TEST_SUITE_P(LstmEnsemble, ModelLaws, LstmEnsemble);
INSTANTIATE_TYPED_TEST_SUITE_P(GruEnsemble, ModelLaws, GruEnsemble);

}  // namespace torsio::test
