#include "torsio/files/model_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "files/safetensors.hpp"
#include "files/whole_file.hpp"
#include "support/error_message.hpp"
#include "support/every_family.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "support/grey_box_examples.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::example;
using test::example_model_file;
using testing::HasSubstr;

/// Torques of a run, as bits: equality without exception for NaN or signed zero.
std::vector<std::uint64_t> run(Estimator estimator) {
  std::vector<std::uint64_t> bits;
  estimator.set_zero("joint_angle_rad", 0.0);
  for (int i = 0; i < 200; ++i) {
    const double angle = 0.1 * std::sin(0.05 * i);
    const Estimate estimate = estimator.step({{angle, -0.2 * angle}});
    bits.push_back(std::bit_cast<std::uint64_t>(estimate.value));
    bits.push_back(std::bit_cast<std::uint64_t>(estimate.std_dev));
    bits.push_back(static_cast<std::uint64_t>(estimate.fault));
  }
  return bits;
}

template <class Family>
class EveryFamily : public testing::Test {};
template <class... Family>
using WithResiduals =
    testing::Types<Family..., test::GreyBoxWithMlp, test::GreyBoxWithDgmm,
                   test::GreyBoxWithProducts, test::GreyBoxWithGp, test::GreyBoxWithBanks>;
TYPED_TEST_SUITE(EveryFamily, KnownFamilies::In<WithResiduals>);

TYPED_TEST(EveryFamily, ComesBackBitForBit) {
  const TemporaryFolder folder;
  using Family = typename TypeParam::Parameters::Family;
  const ModelFile saved = example_model_file(Family(example<TypeParam>()));
  save_model(folder.path("m.safetensors"), saved);
  const ModelFile loaded = load_model(folder.path("m.safetensors"));
  EXPECT_EQ(model_bytes(loaded), model_bytes(saved));
  EXPECT_EQ(run(load_estimator(folder.path("m.safetensors"))), run(make_estimator(saved)));
  EXPECT_EQ(folder.files(), 1U);
}

TEST(ModelFile, KeepsItsCard) {
  const ModelFile saved = example_model_file(example<Linear>());
  const ModelFile loaded = parse_model(model_bytes(saved), "m");
  ModelCard expected = saved.card;
  expected.torsio_version = kVersion;
  EXPECT_EQ(loaded.card, expected);
  EXPECT_EQ(loaded.settings.features, saved.settings.features);
  EXPECT_EQ(loaded.settings.target, "torque_Nm");
  EXPECT_EQ(loaded.settings.sample_rate_Hz, 1000.0);
  EXPECT_EQ(loaded.settings.zeroed_channels, saved.settings.zeroed_channels);
}

TEST(ModelFile, KeepsTheMappingAndReadsFilesWithoutOne) {
  ModelFile saved = example_model_file(example<Linear>());
  const std::vector<std::byte> without = model_bytes(saved);
  EXPECT_EQ(parse_model(without, "m").card.mapping, "");
  const std::string_view text(reinterpret_cast<const char*>(without.data()), without.size());
  EXPECT_EQ(text.find("mapping"), std::string_view::npos) << "the bytes of earlier releases";
  saved.card.mapping = "channels:\n  torque_Nm: {from: \"tau, raw\"}\n";
  EXPECT_EQ(parse_model(model_bytes(saved), "m").card.mapping, saved.card.mapping);
}

TEST(ModelFile, KeepsTheUncertaintyOfTheTargetAndReadsFilesWithoutOne) {
  ModelFile saved = example_model_file(example<Linear>());
  const std::size_t tensors = parse_safetensors(model_bytes(saved), "m").tensors.size();
  EXPECT_FALSE(parse_model(model_bytes(saved), "m").settings.target_uncertainty.is_stated());
  saved.settings.target_uncertainty = {.constant = 0.21, .relative = 0.006};
  EXPECT_EQ(parse_safetensors(model_bytes(saved), "m").tensors.size(), tensors + 2);
  EXPECT_EQ(parse_model(model_bytes(saved), "m").settings.target_uncertainty,
            saved.settings.target_uncertainty);
  saved.settings.target_uncertainty.relative = -0.1;
  const std::vector<std::byte> wrong = model_bytes(saved);
  EXPECT_THAT(error_message([&] { (void)parse_model(wrong, "m"); }),
              HasSubstr("target_uncertainty.relative"));
}

TEST(ModelFile, KeepsWhatHasNoEvidenceAsNaN) {
  ModelFile model = example_model_file(example<Linear>());
  model.card.metrics["rmse"] = kNotMeasured;
  model.settings.fallback.residual_std = kNotMeasured;
  model.settings.residuals = {.edges = {0.0, 1.0}, .std_dev = {kNotMeasured}};
  const ModelFile loaded = parse_model(model_bytes(model), "m");
  EXPECT_TRUE(std::isnan(loaded.card.metrics.at("rmse")));
  EXPECT_TRUE(std::isnan(loaded.settings.fallback.residual_std));
  EXPECT_TRUE(std::isnan(loaded.settings.residuals.std_dev[0]));
}

TEST(ModelFile, NamesItsTensorsAfterTheFields) {
  const Safetensors contents =
      parse_safetensors(model_bytes(example_model_file(example<LinearCoulomb>())), "m");
  std::vector<std::string> names;
  for (const auto& [name, tensor] : contents.tensors) names.push_back(name);
  EXPECT_THAT(names,
              testing::ElementsAre(
                  "fallback.intercept", "fallback.residual_std", "fallback.slope",
                  "guards.disturbances.largest_step", "guards.disturbances.largest_travel",
                  "guards.disturbances.warm_up_s", "guards.output.error_bar_factor",
                  "guards.output.largest_target", "guards.ranges.highest", "guards.ranges.lowest",
                  "guards.ranges.margin", "model.coefficients.feature", "model.coefficients.knots",
                  "model.coefficients.scheduled", "model.coefficients.values", "model.rate_feature",
                  "model.rate_scale", "residuals.edges", "residuals.std_dev"));
  EXPECT_EQ(contents.tensors.at("model.coefficients.values").shape,
            (std::vector<std::size_t>{3, 4}));
  EXPECT_EQ(contents.tensors.at("model.rate_scale").shape, std::vector<std::size_t>{});
  ASSERT_EQ(contents.metadata.size(), 1U);
  EXPECT_THAT(contents.metadata.at("torsio"), HasSubstr(R"("family":"linear_coulomb")"));
}

TEST(ModelFile, NamesTheResidualOfAGreyBoxByItsFamily) {
  const auto names_of = [](const GreyBox& model) {
    std::vector<std::string> names;
    for (const auto& [name, tensor] :
         parse_safetensors(model_bytes(example_model_file(model)), "m").tensors)
      if (name.starts_with("model.residual")) names.push_back(name);
    return names;
  };
  EXPECT_THAT(names_of(example<GreyBox>()), testing::IsEmpty());
  EXPECT_THAT(names_of(example<test::GreyBoxWithMlp>()),
              testing::IsSupersetOf({"model.residual.bound", "model.residual.lowest",
                                     "model.residual.model.mlp.layers.0.weights"}));
  EXPECT_THAT(names_of(example<test::GreyBoxWithDgmm>()),
              testing::Contains("model.residual.model.dgmm.mixture.means"));
}

TEST(ModelFile, AGreyBoxWithoutBanksIsWrittenAsBeforeThereWereAny) {
  const auto names_of = [](const GreyBox& model) {
    std::vector<std::string> names;
    for (const auto& [name, tensor] :
         parse_safetensors(model_bytes(example_model_file(model)), "m").tensors)
      if (name.starts_with("model.terms.")) names.push_back(name);
    return names;
  };
  EXPECT_THAT(
      names_of(example<GreyBox>()),
      testing::UnorderedElementsAre("model.terms.curve_knots", "model.terms.thresholds",
                                    "model.terms.friction_knots", "model.terms.time_constants_s",
                                    "model.terms.rate_scales", "model.terms.sample_period_s"))
      << "files that were written before have these, and load";
  EXPECT_THAT(names_of(example<test::GreyBoxWithBanks>()),
              testing::Contains("model.terms.banks.0.thresholds"));
}

TEST(ModelFile, IsBoundToItsDevice) {
  const TemporaryFolder folder;
  save_model(folder.path("elbow.safetensors"), example_model_file(example<Linear>()));
  EXPECT_NO_THROW((void)load_estimator(folder.path("elbow.safetensors"), {.serial = "elbow-7"}));
  EXPECT_THAT(error_message([&] {
                (void)load_estimator(folder.path("elbow.safetensors"), {.serial = "knee-1"});
              }),
              HasSubstr("elbow.safetensors: device_serial: expected 'knee-1', found 'elbow-7'"));
  ModelFile without_serial = example_model_file(example<Linear>());
  without_serial.card.device_serial = "";
  EXPECT_THAT(error_message([&] { (void)parse_model(model_bytes(without_serial), "m", "knee-1"); }),
              HasSubstr("expected 'knee-1', found none"));
}

TEST(ModelFile, IsNotWrittenIfItCouldNotBeRead) {
  const TemporaryFolder folder;
  save_model(folder.path("m"), example_model_file(example<Linear>()));
  const auto before = read_whole_file(folder.path("m"), kMaxModelFileBytes);
  ModelFile bad = example_model_file(example<Linear>());
  bad.parameters.get<Linear::Parameters>().coefficients.values(0, 1) =
      std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_message([&] { save_model(folder.path("m"), bad); }),
              HasSubstr("m: /model.coefficients.values: expected finite numbers, found nan at "
                        "index 1"));
  bad = example_model_file(example<Linear>());
  bad.settings.features.inputs.pop_back();
  EXPECT_THAT(error_message([&] { save_model(folder.path("m"), bad); }),
              HasSubstr("m: inputs: expected 2, as many as the model takes, found 1"));
  EXPECT_EQ(read_whole_file(folder.path("m"), kMaxModelFileBytes), before);
  EXPECT_EQ(folder.files(), 1U);
}

TEST(ModelFile, TakesAFileNameThatIsNoUtf8) {
  ModelFile model = example_model_file(example<Linear>());
  model.card.training_files = {{"sweep \xff.csv", ""}};
  EXPECT_EQ(parse_model(model_bytes(model), "m").card.training_files[0].file, "sweep \uFFFD.csv");
}

TEST(ModelFile, RunsAtAnotherRateIfTheUserSaysSo) {
  ModelFile model = example_model_file(example<Linear>());
  model.settings.sample_rate_Hz = 250.0;
  EXPECT_EQ(make_estimator(model).settings().sample_rate_Hz, 250.0);
}

TEST(ModelFile, OfAContinuousTimeModelIsDiscretisedForAnotherRate) {
  ModelFile model = example_model_file(example<Viscoelastic>());
  model.settings.sample_rate_Hz = 250.0;
  const Estimator estimator = make_estimator(model);
  EXPECT_EQ(estimator.model().get_if<Viscoelastic>()->sample_period(), 4e-3);
  EXPECT_EQ(model.parameters.get<Viscoelastic::Parameters>().sample_period_s, 1e-3);
}

TEST(ModelFile, OfAGreyBoxIsDiscretisedForAnotherRate) {
  ModelFile model = example_model_file(example<GreyBox>());
  model.settings.sample_rate_Hz = 250.0;
  const Estimator estimator = make_estimator(model);
  EXPECT_EQ(estimator.model().get_if<GreyBox>()->sample_period(), 4e-3);
}

TEST(ModelFile, OfASecondOrderSystemRunsAtItsOwnRateOnly) {
  ModelFile model = example_model_file(example<DynamicBoucWen>());
  const double own_Hz = 1.0 / example<DynamicBoucWen>().sample_period();
  model.settings.sample_rate_Hz = 0.5 * own_Hz;
  EXPECT_THAT(error_message([&] { (void)make_estimator(model); }), HasSubstr("sample rate"));
}

TEST(ModelFile, OfANetworkWithMemoryRunsAtItsOwnRateOnly) {
  ModelFile model = example_model_file(example<Gru>());
  model.settings.sample_rate_Hz = 1000.0 * (1.0 + 1e-4);  // as a clock measures it
  EXPECT_NO_THROW((void)make_estimator(model));
  model.settings.sample_rate_Hz = 250.0;
  EXPECT_THAT(error_message([&] { (void)make_estimator(model); }),
              testing::AllOf(HasSubstr("sample rate: expected 1000 Hz, at which the gru was "
                                       "trained, found 250 Hz"),
                             HasSubstr("resample what it is given to 1000 Hz")));
  model = example_model_file(example<Mlp>());
  model.settings.sample_rate_Hz = 250.0;
  EXPECT_NO_THROW((void)make_estimator(model));
}

TEST(ModelFile, KeepsTheLayersOfANetworkByTheirNumber) {
  const Safetensors contents =
      parse_safetensors(model_bytes(example_model_file(example<Mlp>())), "m");
  EXPECT_EQ(contents.tensors.at("model.layers.1.weights").shape, (std::vector<std::size_t>{5, 7}));
  EXPECT_TRUE(std::holds_alternative<std::vector<float>>(
      contents.tensors.at("model.layers.2.bias").values));
  EXPECT_FALSE(contents.tensors.contains("model.layers.3.bias"));
  const ModelFile loaded = parse_model(model_bytes(example_model_file(example<Lstm>())), "m");
  EXPECT_EQ(loaded.parameters.get<Lstm::Parameters>(), example<Lstm>().parameters());
}

}  // namespace
}  // namespace torsio
