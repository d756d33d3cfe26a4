#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/fmu.hpp"
#include "torsio/files/model_file.hpp"

namespace {

torsio::FmiVersion fmi_version_of(const std::string& text) {
  if (text == "2") return torsio::FmiVersion::two;
  if (text == "3") return torsio::FmiVersion::three;
  throw torsio::UsageError({.place = "--fmi", .expected = "2 or 3", .found = text});
}

/// $CC or cc.
std::string c_compiler() {
  const char* const named = std::getenv("CC");  // NOLINT(concurrency-mt-unsafe): one thread
  return named != nullptr && *named != '\0' ? named : "cc";
}

}  // namespace

void export_fmu(ExportFlags& flags) {
  require_ending("-o", flags.output, {".fmu"});
  const torsio::FmuOptions options{.name = std::filesystem::path(flags.output).stem().string(),
                                   .version = fmi_version_of(flags.fmi),
                                   .real = real_of(flags, torsio::CReal::twofold)};
  const torsio::ModelFile model = torsio::load_model(flags.model);
  torsio::Fmu fmu =
      torsio::make_fmu(model, options, std::filesystem::path(flags.model).filename().string());
  require_new(flags, flags.output);
  if (flags.compile) torsio::compile_fmu(fmu, c_compiler());
  torsio::write_fmu(flags.output, fmu);
  const auto bytes = std::filesystem::file_size(flags.output);
  const char* const real = options.real == torsio::CReal::single ? "float" : "double";
  if (flags.json.wants_tables())
    print(fmt::format("{} written: FMI {}, {}, {}, a tick each {:g} s, {} B, {}\n", flags.output,
                      flags.fmi, model.parameters.family(), real,
                      1.0 / model.settings.sample_rate_Hz, bytes,
                      fmu.platform.empty() ? std::string("sources only (--compile adds a library)")
                                           : fmt::format("library for {}", fmu.platform)));
  nlohmann::json document = export_document(model);
  document["real"] = real;
  document["fmi"] = flags.fmi == "2" ? 2 : 3;
  document["file"] = flags.output;
  document["bytes"] = bytes;
  document["token"] = fmu.token;
  document["platform"] = nullptr;
  if (!fmu.platform.empty()) document["platform"] = fmu.platform;
  for (const torsio::FmuFile& file : fmu.files) document["files"].push_back(file.path);
  flags.json.write(document.dump(2) + "\n");
}
