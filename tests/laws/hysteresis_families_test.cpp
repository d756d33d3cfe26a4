#include "laws/model_laws.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(MaxwellSlipModel, ModelLaws, MaxwellSlipModel);
INSTANTIATE_TYPED_TEST_SUITE_P(PrandtlIshlinskii, ModelLaws, PrandtlIshlinskii);
INSTANTIATE_TYPED_TEST_SUITE_P(ImprovedPrandtlIshlinskii, ModelLaws, ImprovedPrandtlIshlinskii);
INSTANTIATE_TYPED_TEST_SUITE_P(BoucWenModel, ModelLaws, BoucWenModel);
INSTANTIATE_TYPED_TEST_SUITE_P(NonlinearBacklash, ModelLaws, NonlinearBacklash);
INSTANTIATE_TYPED_TEST_SUITE_P(ImprovedNonlinearBacklash, ModelLaws, ImprovedNonlinearBacklash);
INSTANTIATE_TYPED_TEST_SUITE_P(ExponentialLoading, ModelLaws, ExponentialLoading);

INSTANTIATE_TYPED_TEST_SUITE_P(MaxwellSlipModel, InverseLaws, MaxwellSlipModel);
INSTANTIATE_TYPED_TEST_SUITE_P(PrandtlIshlinskii, InverseLaws, PrandtlIshlinskii);
INSTANTIATE_TYPED_TEST_SUITE_P(ImprovedPrandtlIshlinskii, InverseLaws, ImprovedPrandtlIshlinskii);
INSTANTIATE_TYPED_TEST_SUITE_P(BoucWenModel, InverseLaws, BoucWenModel);
INSTANTIATE_TYPED_TEST_SUITE_P(NonlinearBacklash, InverseLaws, NonlinearBacklash);
INSTANTIATE_TYPED_TEST_SUITE_P(ImprovedNonlinearBacklash, InverseLaws, ImprovedNonlinearBacklash);
INSTANTIATE_TYPED_TEST_SUITE_P(ExponentialLoading, InverseLaws, ExponentialLoading);

}  // namespace torsio::test
