#include "fit/transfer/output_map.hpp"

#include <fmt/format.h>

#include <variant>

#include "model/grey_box/grey_box.hpp"
#include "model/linear/linear.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Columns [begin, end) of every row.
void add_to(CoefficientSchedule& coefficients, std::size_t begin, std::size_t end, double offset) {
  for (std::size_t row = 0; row < coefficients.values.rows; ++row)
    for (std::size_t column = begin; column < end; ++column)
      coefficients.values(row, column) += offset;
}

void map(NetworkScaling& scaling, double gain, double offset) {
  scaling.target_centre = gain * scaling.target_centre + offset;
  scaling.target_scale *= gain;
}

// Likelihoods are of standardised quantities, which stay as they are.
void map(Dgmm::Parameters& dgmm, double gain, double offset) {
  dgmm.mixture.centre[0] = gain * dgmm.mixture.centre[0] + offset;
  dgmm.mixture.scale[0] *= gain;
  LinearClamp& clamp = dgmm.clamp;
  clamp.intercept = gain * clamp.intercept + offset;
  for (double& slope : clamp.slope) slope *= gain;
  clamp.width *= gain;
}

void map(InputProducts::Parameters& products, double gain, double offset) {
  for (double& coefficient : products.coefficients) coefficient *= gain;
  products.coefficients.front() += offset;
}

void map(Linear::Parameters& linear, double gain, double offset) {
  for (double& value : linear.coefficients.values.values) value *= gain;
  add_to(linear.coefficients, 0, 1, offset);
}

// The hats of the elastic curve add up to 1 everywhere.
void map(GreyBox::Parameters& box, double gain, double offset) {
  for (double& value : box.coefficients.values.values) value *= gain;
  add_to(box.coefficients, 0, box.terms.curve_knots.size(), offset);
  if (!box.residual) return;
  box.residual->bound *= gain;
  std::visit(
      [gain]<class P>(P& model) {
        if constexpr (requires { model.scaling; }) {
          map(model.scaling, gain, 0.0);
        } else {
          map(model, gain, 0.0);
        }
      },
      box.residual->model);
}

/// @returns whether the family is one of these.
bool try_map(AnyModel::Parameters& parameters, double gain, double offset) {
  const auto try_as = [&]<class P>(P* own) {
    if (own == nullptr) return false;
    if constexpr (requires { own->scaling; }) {
      map(own->scaling, gain, offset);
    } else {
      map(*own, gain, offset);
    }
    return true;
  };
  return try_as(parameters.get_if<Linear::Parameters>()) ||
         try_as(parameters.get_if<GreyBox::Parameters>()) ||
         try_as(parameters.get_if<Dgmm::Parameters>()) ||
         try_as(parameters.get_if<Mlp::Parameters>()) ||
         try_as(parameters.get_if<Lstm::Parameters>()) ||
         try_as(parameters.get_if<Gru::Parameters>());
}

}  // namespace

AnyModel::Parameters with_output(AnyModel::Parameters parameters, double gain, double offset) {
  if (!try_map(parameters, gain, offset))
    throw UsageError(
        {.place = "transfer",
         .expected = "a base model of the family linear, grey_box, dgmm, mlp, lstm or gru",
         .found = fmt::format("one of the family {}", parameters.family())});
  return parameters;
}

bool can_map_output(const AnyModel::Parameters& parameters) {
  AnyModel::Parameters copy = parameters;
  return try_map(copy, 1.0, 0.0);
}

}  // namespace torsio
