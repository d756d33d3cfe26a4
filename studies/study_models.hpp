#pragma once

#include <array>
#include <string_view>

// The models that several studies run, with their settings.

namespace torsio {

/// A model of the table: what its rows are called, and how `--models` asks for it.
struct ComparedFamily {
  std::string_view label;
  std::string_view model;
  bool is_quick = false;  ///< also in the quick study
};

// Where a family's own settings would take minutes a case, cheaper ones: fewer starts, samples, epochs.
inline constexpr std::array kComparedFamilies{
    ComparedFamily{"linear", "linear", true},
    ComparedFamily{"linear_coulomb", "linear_coulomb"},
    ComparedFamily{"polynomial", "polynomial", true},
    ComparedFamily{"maxwell_slip", "maxwell_slip", true},
    ComparedFamily{"prandtl_ishlinskii", "prandtl_ishlinskii"},
    ComparedFamily{"prandtl_ishlinskii_improved", "prandtl_ishlinskii_improved"},
    ComparedFamily{"bouc_wen", "bouc_wen"},
    ComparedFamily{"nonlinear_backlash", "nonlinear_backlash"},
    ComparedFamily{"nonlinear_backlash_improved", "nonlinear_backlash_improved"},
    ComparedFamily{"exponential_loading", "exponential_loading"},
    ComparedFamily{"hammerstein_wiener", "hammerstein_wiener:structure=given:iterations=500", true},
    ComparedFamily{"viscoelastic", "viscoelastic:network=003a:starts=2"},
    ComparedFamily{"grey_box", "grey_box", true},
    ComparedFamily{"grey_box, no residual", "grey_box:residual=none", true},
    ComparedFamily{"dgmm", "dgmm"},
    ComparedFamily{"gaussian_process", "gaussian_process:std_dev=false:restarts=0"},
    ComparedFamily{"parametric_gp", "parametric_gp:updates=5000"},
    ComparedFamily{"parametric_gp_variational",
                   "parametric_gp_variational:inducing_points=50:samples=1000"},
    ComparedFamily{"mlp", "mlp"},
    ComparedFamily{"arx", "arx", true},
    ComparedFamily{"narx_polynomial", "narx_polynomial:training=one_step"},
    ComparedFamily{"lstm", "lstm:layers=16:epochs=10:stride=100"},
};

/// A model on a public benchmark.
struct BenchmarkModel {
  std::string_view name;    ///< model name in its rows
  std::string_view choice;  ///< as `--models` takes it
  std::string_view quick;   ///< the same for `--quick`; empty: left out
  bool is_seeded = false;   ///< another seed makes another model: fitted in every repeat
};

// Settings of the networks: docs/results/benchmarks.md describes how they were selected on the training
// recording.
inline constexpr std::array kBoucWenModels{
    BenchmarkModel{"linear", "linear", "linear"},
    BenchmarkModel{"arx", "arx", "arx"},
    BenchmarkModel{"narx_polynomial, 40 terms",
                   "narx_polynomial:input_lags=5:output_lags=5:terms=40", ""},
    BenchmarkModel{
        "narx_mlp, 16 lags, 128 units",
        "narx_mlp:input_lags=16:output_lags=16:layers=128:activation=tanh:epochs=1600:learning_"
        "rate=0.003:learning_rate_schedule=cosine:patience=0:training=noise:feedback_noise=0.01",
        "narx_mlp:input_lags=16:output_lags=16:layers=16:activation=tanh:epochs=10:training=noise",
        true},
    BenchmarkModel{
        "lstm, 32 cells",
        "lstm:layers=32:window=400:stride=40:burn_in=100:epochs=160:learning_rate=0.01:learning_"
        "rate_schedule=cosine:patience=0",
        "lstm:layers=4:window=100:stride=100:epochs=1", true},
    BenchmarkModel{
        "gru, 64 cells",
        "gru:layers=64:window=400:stride=40:burn_in=100:epochs=160:learning_rate=0.005:learning_"
        "rate_schedule=cosine:patience=0",
        "gru:layers=4:window=100:stride=100:epochs=1", true},
    BenchmarkModel{"dynamic_bouc_wen", "dynamic_bouc_wen", ""},
    BenchmarkModel{"dynamic_bouc_wen, input order 5", "dynamic_bouc_wen:input_order=5", ""}};

inline constexpr std::array kEmpsModels{
    BenchmarkModel{"linear", "linear", "linear"},
    BenchmarkModel{"arx", "arx", "arx"},
    BenchmarkModel{
        "narx_mlp, 16 lags, 64 units",
        "narx_mlp:input_lags=16:output_lags=16:layers=64:activation=tanh:epochs=400:learning_rate="
        "0.003:learning_rate_schedule=cosine:patience=0:training=noise:feedback_noise=0.01",
        "", true},
    BenchmarkModel{
        "lstm, 32 cells",
        "lstm:layers=32:window=1000:stride=100:burn_in=100:epochs=40:learning_rate=0.01:learning_"
        "rate_schedule=cosine:patience=0",
        "lstm:layers=4:window=100:stride=100:epochs=1", true},
    BenchmarkModel{
        "gru, 32 cells",
        "gru:layers=32:window=1000:stride=100:burn_in=100:epochs=40:learning_rate=0.01:learning_"
        "rate_schedule=cosine:patience=0",
        "", true},
    BenchmarkModel{"rigid_drive, 4 numbers", "rigid_drive", "rigid_drive:iterations=50"},
    BenchmarkModel{"rigid_drive, terms=auto", "rigid_drive:terms=auto", ""}};

}  // namespace torsio
