#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/controller_file.hpp"
#include "torsio/export/c_cost.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// The type of the numbers in an exported program.
enum class CReal : std::uint8_t { single, twofold };

/// A raw input that the program is given as counts of an encoder, which a float holds without loss.
struct CCounts {
  std::string channel;
  double counts_per_turn = 0.0;  ///< negative: the angle falls where the counts rise
};

struct C99Options {
  std::string name = "joint";  ///< prefix of all names, a C identifier
  CReal real = CReal::single;
  std::vector<CCounts> counts = {};
  /// The joint's controller, with the model as the inverse of its spring.
  std::optional<ControllerFile> controller = std::nullopt;
};

/// A model as a C program: C99 without a library, without a heap, with its state in a struct of the caller.
struct C99Program {
  std::string header;
  std::string source;
  std::size_t table_bytes = 0;                             ///< constants, in flash
  std::size_t state_bytes = 0;                             ///< size of the state of a joint
  std::size_t local_bytes = 0;                             ///< arrays of a step on the stack
  CCodeCounts code = {};                                   ///< parts of the functions
  CWorkCounts work = {};                                   ///< parts of a step
  std::optional<CWorkCounts> control_work = std::nullopt;  ///< parts of a control step
};

/// Families: linear, linear_coulomb, polynomial, maxwell_slip, prandtl_ishlinskii, grey_box, mlp, gru, lstm, parametric_gp,
/// viscoelastic, hammerstein_wiener. Pipeline, guards, fallback, error bar and faults are those of `Estimator`.
/// @param origin the model's file, for comments
/// @throws UsageError for a name that is not an identifier, another family, or a channel that the model does not have;
/// Error for a number that the type cannot hold.
[[nodiscard]] C99Program c99_program(const ModelFile& model, const C99Options& options,
                                     const std::string& origin);

/// @throws UsageError where the cost of this type cannot be estimated on the target
[[nodiscard]] CCost c_cost(const C99Program& program, const CTarget& target, CReal real);

}  // namespace torsio
