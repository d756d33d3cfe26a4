#pragma once

#include <string>
#include <vector>

#include "common/output.hpp"

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

void export_c99(ExportFlags& flags);
void export_fmu(ExportFlags& flags);
void export_mjcf(ExportFlags& flags);
void export_onnx(ExportFlags& flags);
/// @throws UsageError with the command that writes it
void export_torchscript(ExportFlags& flags);
void export_warp(ExportFlags& flags);
