#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// A model of one joint on another one:
///
///     tau_new = gain f_base(input_scale delta, ...) + offset
///
/// delta is the deflection; inputs that are linear in it (its rate, a low-pass of it) are scaled with it. With
/// input_scale = gain = 1 these are equations (12) to (14) of paper 000.
struct TransferMap {
  double input_scale = 1.0;
  double gain = 1.0;    ///< above 0
  double offset = 0.0;  ///< target's unit
};

/// The model with this map: its parameters, inputs, ranges and error bars.
/// @throws UsageError if scale or gain is not positive, anything is not finite, or the output of the family cannot be
/// mapped (those that can: linear, grey_box, dgmm, mlp, lstm, gru).
[[nodiscard]] ModelFile mapped(const ModelFile& base, const TransferMap& map);

/// What the data sheets of both joints give.
struct TransferRatios {
  double stiffness = 1.0;  ///< stiffness of the new joint over that of the base
  double torque = 1.0;     ///< likewise, rated
};
[[nodiscard]] TransferRatios transfer_ratios(const DataSheet& base, const DataSheet& joint);

/// How a base model is brought to a new joint.
enum class TransferMethod : std::uint8_t {
  none,         ///< as it is
  offset,       ///< the mean error of the first 100 measured samples: (12) to (14)
  gain_offset,  ///< gain and offset by least squares
  data_sheets,  ///< inputs by the ratio of the stiffnesses, gain by that of the rated torques, offset by least squares
  scaled,       ///< scale of the inputs, gain and offset by least squares
  refit,        ///< the best of those, then the coefficients, close to the base's
};
[[nodiscard]] std::string_view name(TransferMethod method) noexcept;

struct TransferOptions {
  /// Only this method; empty: the one with the least error on the held-out part of the new data.
  std::optional<TransferMethod> method = {};
  std::optional<TransferRatios> ratios = {};  ///< without: no `data_sheets`
  double held_out_share = 0.3;       ///< last part of the new data, on which methods are compared
  std::size_t offset_samples = 100;  ///< i of (13)
};

/// One method on the new data.
struct TransferTrial {
  ModelFile file;  ///< fitted to all of the new data
  TransferMethod method = TransferMethod::none;
  TransferMap map = {};
  double prior = 0.0;          ///< weight of the base in a refit; 0: none
  double held_out_rmse = 0.0;  ///< on the held-out part, fitted to the other part
};

struct TransferResult {
  std::vector<TransferTrial> trials;  ///< one for each method that was possible
  std::size_t chosen = 0;             ///< index of the one with the least `held_out_rmse`
  std::vector<std::string> notes;

  [[nodiscard]] const TransferTrial& best() const { return trials[chosen]; }
};

/// Brings a base model to a new joint with few data. All methods are fitted to the first part of the segments with
/// the role train and compared on the rest of them, in free run; then all are fitted to all of it.
///
/// The refit minimises, with c_0 the coefficients of the base after the map and m_j the largest |phi_j|,
///
///     sum_n (y_n - phi_n c)^2 + prior N sum_j m_j^2 (c_j - c_0j)^2
///
/// over the coefficients of a linear model, of a grey box (slip forces and branches that are >= 0 remain so) and the
/// weights in the last layer of a network; in a Gaussian mixture it is the maximum a posteriori of means and covariances
/// with that many samples of the base in each component (Gauvain & Lee 1994). The weight is chosen with the
/// method. Source: paper 000 section 5.4 for `offset`; the others are ours.
/// @throws Error if an input or the target is missing or constant, or there are fewer than 50 samples; UsageError if
/// the method cannot be applied to the family or needs ratios; Cancelled. The base is not changed.
[[nodiscard]] TransferResult transfer_model(const ModelFile& base, const Dataset& dataset,
                                            const TransferOptions& options = {},
                                            const Progress& progress = {});

}  // namespace torsio
