#include "export/warp_module.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

constexpr std::array<std::string_view, 35> kPythonKeywords{
    "False", "None",     "True",  "and",    "as",   "assert", "async",  "await",    "break",
    "class", "continue", "def",   "del",    "elif", "else",   "except", "finally",  "for",
    "from",  "global",   "if",    "import", "in",   "is",     "lambda", "nonlocal", "not",
    "or",    "pass",     "raise", "return", "try",  "while",  "with",   "yield"};

void check_warp_name(const std::string& name) {
  const auto is_part = [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  };
  if (name.empty() || !std::ranges::all_of(name, is_part) ||
      std::isdigit(static_cast<unsigned char>(name.front())) != 0 ||
      std::ranges::find(kPythonKeywords, name) != kPythonKeywords.end())
    throw UsageError({.place = "the name of the module",
                      .expected =
                          "a name that Python can import: letters, digits and _, not a digit "
                          "first, not a keyword",
                      .found = '"' + name + '"'});
  if (name == "warp" || name == "math")
    throw UsageError({.place = "the name of the module",
                      .expected = "a name that does not hide another module",
                      .found = '"' + name + '"'});
}

/// The text without what would end a docstring or is not shown in one.
std::string docstring_part(std::string text) {
  for (char& letter : text)
    if (letter == '"' || letter == '\\' || static_cast<unsigned char>(letter) < ' ') letter = '_';
  return text;
}

std::string python_names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& each : names) text += fmt::format("\"{}\", ", each);
  return text.empty()
             ? "()"
             : fmt::format("({})", text.substr(0, text.size() - (names.size() == 1 ? 1 : 2)));
}

std::string python_fault_names() {
  std::string text;
  for (std::size_t i = 0; i < kFaultCount; ++i)
    text += fmt::format("    \"{}\",\n", name(static_cast<Fault>(i)));
  return "(\n" + text + ")";
}

constexpr const char* kWarpModule =
    R"py("""A spring's torque as a kernel of NVIDIA Warp, one thread for each joint.

Written by torsio {version} from {origin}: {family}, {target}, {rate} Hz. Needs Warp 1.5 or later. NOT TESTED WITH WARP: the
tests of torsio run this code with a substitute for the package.

    import {module}
    joints = {module}.make_state(4096, "cuda:0")
    {module}.check_timestep(model.opt.timestep)  # one call is one tick of {period} s
    {module}.step(inputs, joints)  # inputs: wp.array2d of INPUTS in SI, one row for each joint
    joints.value, joints.std_dev, joints.fault  # std_dev is NaN where there is no evidence; fault: index of FAULTS
    {module}.reset(joints, is_done)  # the joints whose number in is_done is not 0

Guards, fallback, error bar and faults are those of torsio's estimator, without its rule of jumps; a tick without inputs (NaN) is a
long gap. From the channels in ZEROED the caller subtracts their zeros. Nothing is allocated in a step: it can be part of a CUDA
graph. It is not differentiable.

MuJoCo-Warp, one joint in each world, whose spring is between two hinges (their places in qpos and their degrees of freedom):

    @wp.kernel
    def gather(qpos: wp.array2d(dtype=float), inputs: wp.array2d(dtype=wp.{state_type})):
        world = wp.tid()
        inputs[world, 0] = wp.{state_type}(qpos[world, GEAR])      # INPUTS[0]
        inputs[world, 1] = wp.{state_type}(qpos[world, JOINT])     # INPUTS[1]

    @wp.kernel
    def apply(torque: wp.array(dtype=wp.{value_type}), qfrc_applied: wp.array2d(dtype=float)):
        world = wp.tid()
        qfrc_applied[world, GEAR_DOF] = -float(torque[world])
        qfrc_applied[world, JOINT_DOF] = float(torque[world])

    wp.launch(gather, dim=nworld, inputs=[d.qpos], outputs=[inputs])
    {module}.step(inputs, joints)
    wp.launch(apply, dim=nworld, inputs=[joints.value], outputs=[d.qfrc_applied])
    mujoco_warp.step(m, d)
"""

import warp as wp

wp.set_module_options({{"enable_backward": False}})

RATE_HZ = float({rate})
TARGET = "{target}"
INPUTS = {inputs}
ZEROED = {zeroed}
FAULTS = {faults}
STATE_WIDTH = {state_width}
NUMBER = wp.{state_type}  # of inputs and state
REAL = wp.{value_type}  # of value and error bar

{tables}{helpers}
@wp.kernel(enable_backward=False)
def tick(
    inputs: wp.array2d(dtype=wp.{state_type}),
    timestep_s: wp.{state_type},
{arguments}    state: wp.array2d(dtype=wp.{state_type}),
    value: wp.array(dtype=wp.{value_type}),
    std_dev: wp.array(dtype=wp.{value_type}),
    fault: wp.array(dtype=wp.int32),
):
    i = wp.tid()
{kernel}

@wp.kernel(enable_backward=False)
def clear(is_reset: wp.array(dtype=wp.int32), state: wp.array2d(dtype=wp.{state_type})):
    i, k = wp.tid()
    if is_reset[i] != 0:
        state[i, k] = wp.{state_type}(0.0)


class Joints:
    """State and results of joints, in arrays that stay where they are."""

    def __init__(self, joints, device=None):
        self.joints = joints
        self.state = wp.zeros((joints, {allocated_width}), dtype=NUMBER, device=device)
        self.device = self.state.device
        self.value = wp.zeros(joints, dtype=REAL, device=device)
        self.std_dev = wp.zeros(joints, dtype=REAL, device=device)
        self.fault = wp.zeros(joints, dtype=wp.int32, device=device)
        self._constant = [
{constants}        ]


def make_state(joints, device=None):
    """Joints after a reset; a state of 0 is that."""
    return Joints(joints, device)


def step(inputs, joints, timestep_s=1.0 / RATE_HZ):
    """One tick of all joints: from inputs (joints, len(INPUTS)) of NUMBER to joints.value, joints.std_dev and joints.fault.

    Another time since the last tick than the period of the model is the fault wrong_rate, if the model depends on time.
    """
    if inputs.dtype != NUMBER or tuple(inputs.shape) != (joints.joints, len(INPUTS)):
        raise ValueError(f"inputs: expected {{(joints.joints, len(INPUTS))}} of {{NUMBER}}, found {{inputs.shape}} of {{inputs.dtype}}")
    wp.launch(
        tick,
        dim=joints.joints,
        inputs=[inputs, timestep_s, *joints._constant],
        outputs=[joints.state, joints.value, joints.std_dev, joints.fault],
        device=joints.device,
    )


def reset(joints, is_reset=None):
    """All joints, or those whose number in is_reset (a wp.array of int32, one for each joint) is not 0, as after a reset."""
    if is_reset is None:
        joints.state.zero_()
        return
    wp.launch(clear, dim=(joints.joints, {allocated_width}), inputs=[is_reset], outputs=[joints.state], device=joints.device)


def check_timestep(timestep_s):
    """Raises ValueError if one step of the simulation is not one tick of the model."""
    if not abs(timestep_s * RATE_HZ - 1.0) < 1e-6:
        raise ValueError(f"timestep: expected {{1.0 / RATE_HZ:g}} s, the period of the model, found {{timestep_s:g}} s")
)py";

/// For numbers of {n} bits. A NaN of an operand is one of the result, which Warp's min and max do not promise; its sign of 0
/// is 1.
constexpr const char* kWarpHelpers = R"py(
@wp.func
def pick_{n}(condition: bool, yes: wp.float{n}, no: wp.float{n}):
    if condition:
        return yes
    return no


@wp.func
def lower_{n}(a: wp.float{n}, b: wp.float{n}):
    if a < b or a != a:
        return a
    return b


@wp.func
def higher_{n}(a: wp.float{n}, b: wp.float{n}):
    if b < a or a != a:
        return a
    return b


@wp.func
def sign_{n}(a: wp.float{n}):
    if a < wp.float{n}(0.0):
        return wp.float{n}(-1.0)
    if wp.float{n}(0.0) < a:
        return wp.float{n}(1.0)
    return a


@wp.func
def sigmoid_{n}(a: wp.float{n}):
    return wp.float{n}(1.0) / (wp.float{n}(1.0) + wp.exp(-a))


@wp.func
def cell_{n}(x: wp.float{n}, table: wp.array(dtype=wp.float{n}), first: int, cells: int):
    cell = int(0)
    for k in range(1, cells):
        knot = table[first + k]
        if knot <= x:
            cell = k
    return cell

)py";

}  // namespace

std::string warp_module(const StepGraph& graph, const WarpModuleParts& parts,
                        const WarpKernelOptions& options, const std::string& origin) {
  check_warp_name(options.name);
  const char* state_type = parts.has_wide_state ? "float64" : "float32";
  const char* value_type = parts.has_wide_values ? "float64" : "float32";
  std::string helpers;
  if (parts.has_functions_32) helpers += fmt::format(kWarpHelpers, fmt::arg("n", 32));
  if (parts.has_functions_64) helpers += fmt::format(kWarpHelpers, fmt::arg("n", 64));
  std::string tables;
  std::string arguments;
  std::string constants;
  for (const int bits : {32, 64}) {
    const std::string& numbers = bits == 64 ? parts.table_64 : parts.table_32;
    if (numbers.empty()) continue;
    tables += fmt::format("TABLE_{} = [\n{}]\n\n", bits, numbers);
    arguments += fmt::format("    table_{0}: wp.array(dtype=wp.float{0}),\n", bits);
    constants +=
        fmt::format("            wp.array(TABLE_{0}, dtype=wp.float{0}, device=device),\n", bits);
  }
  for (const int bits : {32, 64}) {
    const std::size_t width = bits == 64 ? parts.work_64 : parts.work_32;
    if (width == 0) continue;
    // Beside each other are the numbers of different joints, which threads write at the same time.
    arguments += fmt::format("    work_{0}: wp.array2d(dtype=wp.float{0}),\n", bits);
    constants += fmt::format(
        "            wp.zeros(({1}, joints), dtype=wp.float{0}, device=device),\n", bits, width);
  }
  return fmt::format(
      fmt::runtime(kWarpModule), fmt::arg("version", kVersion),
      fmt::arg("origin", docstring_part(origin)), fmt::arg("family", graph.family),
      fmt::arg("target", docstring_part(graph.target)),
      fmt::arg("rate", fmt::format("{}", graph.sample_rate_Hz)),
      fmt::arg("period", 1.0 / graph.sample_rate_Hz), fmt::arg("module", options.name),
      fmt::arg("state_type", state_type), fmt::arg("value_type", value_type),
      fmt::arg("inputs", python_names(graph.raw_inputs)),
      fmt::arg("zeroed", python_names(graph.zeroed_channels)),
      fmt::arg("faults", python_fault_names()), fmt::arg("state_width", graph.state_width),
      fmt::arg("allocated_width", std::max<std::size_t>(graph.state_width, 1)),
      fmt::arg("tables", tables), fmt::arg("helpers", helpers), fmt::arg("arguments", arguments),
      fmt::arg("kernel", parts.kernel), fmt::arg("constants", constants));
}

}  // namespace torsio
