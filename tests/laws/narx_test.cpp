#include "model/narx/narx.hpp"

#include "laws/model_laws.hpp"
#include "model/narx/multivariate_polynomial.hpp"

namespace torsio::test {

INSTANTIATE_TYPED_TEST_SUITE_P(NarxLinear, ModelLaws, Narx<Linear>);
INSTANTIATE_TYPED_TEST_SUITE_P(NarxPolynomial, ModelLaws, Narx<MultivariatePolynomial>);
INSTANTIATE_TYPED_TEST_SUITE_P(NarxMlp, ModelLaws, Narx<Mlp>);
INSTANTIATE_TYPED_TEST_SUITE_P(NarxDgmm, ModelLaws, Narx<Dgmm>);
INSTANTIATE_TYPED_TEST_SUITE_P(NarxGaussianProcess, ModelLaws, Narx<GaussianProcess>);
INSTANTIATE_TYPED_TEST_SUITE_P(NarxParametricGp, ModelLaws, Narx<ParametricGp>);

}  // namespace torsio::test
