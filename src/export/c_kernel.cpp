#include "export/c_kernel.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "export/c_statements.hpp"
#include "model/gaussian_process/kernel.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {
namespace {

/// One kernel of an expression as C statements that set `k_<n>`.
std::string leaf(CText& c, std::size_t n, const KernelNode& node, std::size_t inputs) {
  std::vector<double> weights;
  for (const double scale : node.length_scales) weights.push_back(1.0 / (scale * scale));
  if (weights.size() == 1) weights.resize(inputs, weights.front());
  const std::string table = c.table(fmt::format("weights_{}", n), weights);
  const std::string variance = c.number(node.amplitude * node.amplitude);
  const auto kind = static_cast<KernelKind>(node.kind);
  std::string term = "(x[i] - z[i]) * (x[i] - z[i])";
  if (kind == KernelKind::linear)
    term = fmt::format("(x[i] - {0}) * (z[i] - {0})", c.number(node.shape));
  if (kind == KernelKind::periodic) {
    term =
        fmt::format("@square(@sine((x[i] - z[i]) * {}))", c.number(std::numbers::pi / node.shape));
    if (c.claim("square")) c.add("\nstatic @real @square(@real x) { return x * x; }\n");
  }
  std::string value;
  switch (kind) {
    case KernelKind::linear: value = "sum"; break;
    case KernelKind::periodic: value = "@exponential((@real)-2 * sum)"; break;
    case KernelKind::rational_quadratic:
      value = fmt::format("@power((@real)1 + sum * {}, {})", c.number(0.5 / node.shape),
                          c.number(-node.shape));
      break;
    case KernelKind::matern32: value = "((@real)1 + root) * @exponential(-root)"; break;
    case KernelKind::matern52:
      value = "((@real)1 + root + root * root / (@real)3) * @exponential(-root)";
      break;
    default: value = "@exponential((@real)-0.5 * sum)";
  }
  std::string root;
  if (kind == KernelKind::matern32 || kind == KernelKind::matern52) {
    root = fmt::format("  root = @square_root((@real){} * sum);\n",
                       kind == KernelKind::matern32 ? 3 : 5);
  }
  return fmt::format(
      "  for (i = 0U, sum = (@real)0; i < {}; ++i) sum += {} * {}[i];\n{}  k_{} = {} * {};\n",
      counted(inputs), term, table, root, n, variance, value);
}

/// Counts the functions that a kernel calls for so many covariances.
void add_functions(CText& c, const KernelNode& node, double values, std::size_t inputs) {
  switch (static_cast<KernelKind>(node.kind)) {
    case KernelKind::linear:
    case KernelKind::sum:
    case KernelKind::product: return;
    case KernelKind::periodic: c.work(CWork::sine, values * static_cast<double>(inputs)); break;
    case KernelKind::rational_quadratic: c.work(CWork::logarithm, values); break;
    case KernelKind::matern32:
    case KernelKind::matern52: c.work(CWork::root, values); break;
    default: break;
  }
  c.work(CWork::exponential, values);
}

/// Writes `real NAME_kernel(x, z)`, the covariance of two points.
void write_kernel(CText& c, const KernelExpression& kernel, std::size_t inputs) {
  std::string body;
  std::string names;
  std::vector<std::size_t> operands;
  for (std::size_t n = 0; n < kernel.nodes.size(); ++n) {
    names += fmt::format(", k_{}", n);
    const auto kind = static_cast<KernelKind>(kernel.nodes[n].kind);
    if (kind != KernelKind::sum && kind != KernelKind::product) {
      body += leaf(c, n, kernel.nodes[n], inputs);
      operands.push_back(n);
      continue;
    }
    const std::size_t right = operands.back();
    operands.pop_back();
    body += fmt::format("  k_{} = k_{} {} k_{};\n", n, operands.back(),
                        kind == KernelKind::sum ? '+' : '*', right);
    operands.back() = n;
  }
  if (body.find("root") != std::string::npos) names += ", root";
  c.add(R"c(
static @real @kernel(const @real *x, const @real *z) {
  @real sum$NAMES$;
  uint32_t i;
$BODY$  return k_$LAST$;
}
)c",
        {{"NAMES", names}, {"BODY", body}, {"LAST", fmt::format("{}", kernel.nodes.size() - 1)}});
}

/// R with R^T R = C: a sum of squares loses less to rounding than q C q.
Matrix root_of(const Matrix& explained) {
  const auto size = static_cast<Eigen::Index>(explained.rows);
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> c(
      explained.values.data(), size, size);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(c);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < size; ++i)
    if (solver.eigenvalues()[i] > 0.0) kept.push_back(i);
  Matrix root(std::max<std::size_t>(kept.size(), 1), explained.columns);
  for (std::size_t i = 0; i < kept.size(); ++i)
    for (Eigen::Index j = 0; j < size; ++j)
      root(i, static_cast<std::size_t>(j)) =
          std::sqrt(solver.eigenvalues()[kept[i]]) * solver.eigenvectors()(j, kept[i]);
  return root;
}

/// Counts the work of so many covariances.
void add_work(CText& c, const KernelExpression& kernel, double values, std::size_t inputs) {
  std::size_t kernels = 0;
  for (const KernelNode& node : kernel.nodes)
    if (node.kind < static_cast<std::size_t>(KernelKind::sum)) ++kernels;
  c.work(CWork::kernel_term, values * static_cast<double>(kernels * inputs));
  c.work(CWork::kernel_value, values * static_cast<double>(kernels));
  c.work(CWork::kernel, static_cast<double>(kernels));
  for (const KernelNode& node : kernel.nodes) add_functions(c, node, values, inputs);
}

std::vector<double> input_factors(const NetworkScaling& scaling) {
  std::vector<double> factors;
  for (const double scale : scaling.inputs.scale) factors.push_back(1.0 / scale);
  return factors;
}

}  // namespace

void write_gp_mean(CText& c, const ParametricGp::Parameters& p) {
  const std::size_t inputs = p.inducing_points.columns;
  const std::size_t points = p.inducing_points.rows;
  write_kernel(c, p.kernel, inputs);
  add_work(c, p.kernel, static_cast<double>(points), inputs);
  c.work(CWork::kernel_weight, static_cast<double>(points));
  c.local_reals(inputs);
  c.add(R"c(
static @real @mean(const @real *x) {
  @real in[$INPUTS$], mean = (@real)0;
  uint32_t i;
  for (i = 0U; i < $INPUTS$U; ++i) in[i] = (x[i] - $CENTRE$[i]) * $FACTOR$[i];
  for (i = 0U; i < $POINTS$U; ++i) mean += $WEIGHTS$[i] * @kernel(in, $AT$ + i * $INPUTS$U);
  return $TARGET_CENTRE$ + $TARGET_SCALE$ * mean;
}
)c",
        {{"INPUTS", fmt::format("{}", inputs)},
         {"POINTS", fmt::format("{}", points)},
         {"CENTRE", c.table("input_centre", p.scaling.inputs.centre)},
         {"FACTOR", c.table("input_factor", input_factors(p.scaling))},
         {"AT", c.table("inducing_points", p.inducing_points.values)},
         {"WEIGHTS", c.table("weights", p.weights)},
         {"TARGET_CENTRE", c.number(p.scaling.target_centre)},
         {"TARGET_SCALE", c.number(p.scaling.target_scale)}});
}

void write_parametric_gp(CText& c, const ParametricGp::Parameters& p) {
  const std::size_t inputs = p.inducing_points.columns;
  const std::size_t points = p.inducing_points.rows;
  const Matrix root = root_of(p.explained);
  write_kernel(c, p.kernel, inputs);
  add_work(c, p.kernel, static_cast<double>(points) + 1.0, inputs);
  c.work(CWork::kernel_weight, static_cast<double>(points * (root.rows + 1)));
  c.work(CWork::kernel_unit, static_cast<double>(root.rows));
  c.work(CWork::root);
  c.member(fmt::format("@real covariance[{}]", points));
  c.local_reals(inputs);
  c.add(R"c(
static void @reset_model(@state *s) {
  (void)s;
}
static @estimate @model(@state *s, const @real *x) {
  @real in[$INPUTS$], mean = (@real)0, explained = (@real)0, left;
  @estimate out;
  uint32_t i, j;
  for (j = 0U; j < $INPUTS$U; ++j) in[j] = (x[j] - $CENTRE$[j]) * $FACTOR$[j];
  for (i = 0U; i < $POINTS$U; ++i) {
    s->covariance[i] = @kernel(in, $AT$ + i * $INPUTS$U);
    mean += $WEIGHTS$[i] * s->covariance[i];
  }
  for (i = 0U; i < $ROWS$U; ++i) {
    @real sum = (@real)0;
    for (j = 0U; j < $POINTS$U; ++j) sum += $ROOT$[i * $POINTS$U + j] * s->covariance[j];
    explained += sum * sum;
  }
  out = @plain($TARGET_CENTRE$ + $TARGET_SCALE$ * mean);
  if (!@is_finite(mean)) {
    out.value = $TARGET_CENTRE$;
    out.fault = @MODEL_NOT_FINITE;
    return out;
  }
  left = @kernel(in, in) - explained;
  if (@is_finite(left))
    out.std_dev = $TARGET_SCALE$ * @square_root((left > (@real)0 ? left : (@real)0) + $NOISE$);
  return out;
}
)c",
        {{"INPUTS", fmt::format("{}", inputs)},
         {"POINTS", fmt::format("{}", points)},
         {"CENTRE", c.table("input_centre", p.scaling.inputs.centre)},
         {"FACTOR", c.table("input_factor", input_factors(p.scaling))},
         {"AT", c.table("inducing_points", p.inducing_points.values)},
         {"WEIGHTS", c.table("weights", p.weights)},
         {"ROWS", fmt::format("{}", root.rows)},
         {"ROOT", c.table("explained_root", root.values)},
         {"TARGET_CENTRE", c.number(p.scaling.target_centre)},
         {"TARGET_SCALE", c.number(p.scaling.target_scale)},
         {"NOISE", c.number(p.noise_variance)}});
}

}  // namespace torsio
