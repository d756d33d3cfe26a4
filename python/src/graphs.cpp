#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "export/drive_inputs.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/export/step_graph.hpp"

namespace torsio::python {
namespace {

const char* type_name(StepGraph::Type type) {
  switch (type) {
    case StepGraph::Type::real: return "real";
    case StepGraph::Type::wide: return "wide";
    case StepGraph::Type::single: return "single";
    case StepGraph::Type::truth: break;
  }
  return "truth";
}

template <class Number>
py::array_t<Number> table_array(const detail::Table2d<Number>& table) {
  py::array_t<Number> array({table.rows, table.columns});
  std::ranges::copy(table.values, array.mutable_data());
  return array;
}

template <class Number>
py::array_t<Number> row_array(const std::vector<Number>& values) {
  return py::array_t<Number>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::list nodes_of(const StepGraph& graph) {
  py::list nodes;
  for (const StepGraph::Node& node : graph.nodes) {
    const py::object values = node.operation == GraphOperation::constant
                                  ? py::object(table_array(node.values))
                                  : py::object(py::none());
    nodes.append(py::make_tuple(std::string(name(node.operation)), type_name(node.type), node.width,
                                node.operands, node.first, node.is_common, values));
  }
  return nodes;
}

GraphPrecision precision_of(const std::string& text) {
  if (text == "float") return GraphPrecision::single;
  if (text == "mixed") return GraphPrecision::mixed;
  if (text == "double") return GraphPrecision::twofold;
  throw UsageError({.place = "precision", .expected = "double, mixed or float", .found = text});
}

py::dict graph_of(const Model& model, const std::string& precision, bool guards) {
  const StepGraph graph =
      step_graph(*model.file, {.precision = precision_of(precision), .has_guards = guards});
  py::dict result;
  result["nodes"] = nodes_of(graph);
  result["value"] = graph.value;
  result["std_dev"] = graph.std_dev;
  result["fault"] = graph.fault;
  result["next_state"] = graph.next_state;
  result["state_width"] = graph.state_width;
  result["raw_inputs"] = graph.raw_inputs;
  py::list parts;
  for (const StepGraph::StatePart& part : graph.state)
    parts.append(py::make_tuple(part.name, part.first, part.width));
  result["state"] = parts;
  return result;
}

py::list dense_arrays(const std::vector<DenseLayer>& layers) {
  py::list all;
  for (const DenseLayer& layer : layers)
    all.append(py::make_tuple(table_array(layer.weights), row_array(layer.bias),
                              std::string(name(static_cast<Activation>(layer.activation)))));
  return all;
}

/// A network and the place of its inputs, for programs that give it position errors and speeds.
py::dict drive_network(const Model& model, const std::string& place) {
  const DriveInputs inputs = drive_inputs(*model.file, place);
  py::dict result;
  result["lags"] = inputs.lags;
  result["position_errors"] = inputs.position_errors;
  result["speeds"] = inputs.speeds;
  const NetworkScaling* scaling = nullptr;
  py::list recurrent;
  if (const auto* mlp = model.file->parameters.get_if<Mlp::Parameters>()) {
    scaling = &mlp->scaling;
    result["dense"] = dense_arrays(mlp->layers);
  } else if (const auto* lstm = model.file->parameters.get_if<Lstm::Parameters>()) {
    scaling = &lstm->scaling;
    for (const LstmLayer& layer : lstm->layers)
      recurrent.append(py::make_tuple(table_array(layer.input_weights),
                                      table_array(layer.recurrent_weights), row_array(layer.bias)));
    result["dense"] = dense_arrays(lstm->head);
  } else {
    throw UsageError({.place = place,
                      .expected = "an mlp or an lstm",
                      .found = std::string(model.file->parameters.family()),
                      .advice = "Export it without a layout: its estimator."});
  }
  result["recurrent"] = recurrent;
  result["centre"] = row_array(scaling->inputs.centre);
  result["scale"] = row_array(scaling->inputs.scale);
  result["target_centre"] = scaling->target_centre;
  result["target_scale"] = scaling->target_scale;
  return result;
}

}  // namespace

void bind_graphs(py::module_& module) {
  module.def("step_graph", graph_of, py::arg("model"), py::kw_only(),
             py::arg("precision") = "mixed", py::arg("guards") = true,
             "A tick of the estimator as operations on rows; torsio.torch evaluates them.");
  module.def("drive_network", drive_network, py::arg("model"), py::arg("place"),
             "The layers of an mlp or lstm of position errors and speeds.");
}

}  // namespace torsio::python
