#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/export/step_graph.hpp"
#include "torsio/files/model_file.hpp"

/// The flags of `torsio export`. One of the targets is named: c99, onnx, torchscript, mjcf, fmi or warp.
struct ExportFlags {
  std::string model;
  std::string c99;
  std::string real;  ///< empty: that of the target
  std::vector<std::string> counts;
  std::string controller;
  std::string output;
  std::string target;
  std::string flash;
  std::string ram;
  std::string clock;
  bool mjcf = false;
  std::string actuator;  ///< empty: the default of `--mjcf`
  bool linear_spring = false;
  bool onnx = false;
  bool torchscript = false;
  std::string layout;  ///< empty: the estimator
  std::string fmi;     ///< version; empty: none
  bool compile = false;
  bool warp = false;
  bool overwrite = false;
  JsonOutput json;
};

/// @throws UsageError if the file exists and is not to be replaced; Error if it cannot be written
void require_new(const ExportFlags& flags, const std::string& file);

/// The type of --real. @throws UsageError for another than float and double
torsio::CReal real_of(const ExportFlags& flags, torsio::CReal otherwise);
/// The same with `mixed`.
torsio::GraphPrecision precision_of(const ExportFlags& flags, torsio::GraphPrecision otherwise);

/// What the document of each target begins with.
nlohmann::json export_document(const torsio::ModelFile& model);

void export_c99(ExportFlags& flags);
void export_fmu(ExportFlags& flags);
void export_mjcf(ExportFlags& flags);
void export_onnx(ExportFlags& flags);
/// @throws UsageError with the command that writes it
void export_torchscript(ExportFlags& flags);
void export_warp(ExportFlags& flags);
