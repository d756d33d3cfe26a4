#pragma once

#include <span>
#include <vector>

#include "torsio/arm/contact_detector.hpp"

namespace torsio {

/// External torques of one joint without contacts, and what their variance grows with.
struct ExternalTorqueSamples {
  std::vector<double> external_Nm = {};
  std::vector<ExternalTorqueTerms> terms = {};
};

/// The coefficients of the largest likelihood of errors that are normal with mean 0:
///
///     minimise Σ_n (ln σ_n² + e_n² / σ_n²),   σ_n² = Σ_k c_k x_nk,   c_k ≥ 0
///
/// by multiplicative updates c_k ← c_k √(Σ x_nk e_n² / σ_n⁴ / Σ x_nk / σ_n²), which increase the likelihood in each step and
/// keep every coefficient positive (a majorisation as in Hunter & Lange 2004). The constant is at least 0.1 % of the mean square.
/// @throws Error for fewer than 100 samples or one that is not finite.
[[nodiscard]] ExternalTorqueError fit_external_torque_error(const ExternalTorqueSamples& samples);

}  // namespace torsio
