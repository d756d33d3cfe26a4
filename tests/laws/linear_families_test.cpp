#include "laws/model_laws.hpp"
#include "support/grey_box_examples.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(Linear, ModelLaws, Linear);
INSTANTIATE_TYPED_TEST_SUITE_P(LinearCoulomb, ModelLaws, LinearCoulomb);
INSTANTIATE_TYPED_TEST_SUITE_P(Polynomial, ModelLaws, Polynomial);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBox, ModelLaws, GreyBox);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBoxWithMlp, ModelLaws, GreyBoxWithMlp);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBoxWithDgmm, ModelLaws, GreyBoxWithDgmm);
INSTANTIATE_TYPED_TEST_SUITE_P(AnyModel, ModelLaws, AnyModel);

INSTANTIATE_TYPED_TEST_SUITE_P(Linear, InverseLaws, Linear);
INSTANTIATE_TYPED_TEST_SUITE_P(LinearCoulomb, InverseLaws, LinearCoulomb);
INSTANTIATE_TYPED_TEST_SUITE_P(Polynomial, InverseLaws, Polynomial);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBox, InverseLaws, GreyBox);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBoxWithMlp, InverseLaws, GreyBoxWithMlp);
INSTANTIATE_TYPED_TEST_SUITE_P(GreyBoxWithDgmm, InverseLaws, GreyBoxWithDgmm);
INSTANTIATE_TYPED_TEST_SUITE_P(AnyModel, InverseLaws, AnyModel);

}  // namespace torsio::test
