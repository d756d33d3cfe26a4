#include "torsio/export/fmu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "core/fnv_hash.hpp"
#include "data/arrays/zip_archive.hpp"
#include "export/fmi_variables.hpp"
#include "files/output_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

/// A hash in the form of a GUID, which FMI 2 asks for.
std::string token_of(const std::string& text) {
  const std::uint64_t first = text_hash(text);
  const std::uint64_t second = text_hash(fmt::format("{:016x}", first) + text);
  return fmt::format("{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}", first >> 32, (first >> 16) & 0xFFFF,
                     first & 0xFFFF, second >> 48, second & 0xFFFFFFFFFFFF);
}

void check_names(const FmiVariables& variables) {
  std::vector<std::string> names{"time", "std_dev", "fault", variables.target};
  for (const std::string& channel : variables.zeros) names.push_back("zero_" + channel);
  for (const std::string& channel : variables.inputs)
    if (std::ranges::find(names, channel) != names.end())
      throw Error({.place = "export as an FMU",
                   .expected = "a model whose inputs are named otherwise than its outputs",
                   .found = fmt::format("{} as both", channel)});
}

}  // namespace

Fmu make_fmu(const ModelFile& model, const FmuOptions& options, const std::string& origin) {
  const C99Program program =
      c99_program(model, {.name = options.name, .real = options.real}, origin);
  FmiVariables variables{
      .inputs =
          FeaturePipeline(model.settings.features, model.settings.sample_rate_Hz).raw_inputs(),
      .zeros = {},
      .target = model.settings.target,
      .period_s = 1.0 / model.settings.sample_rate_Hz};
  for (const std::string& channel : variables.inputs)
    if (std::ranges::find(model.settings.zeroed_channels, channel) !=
        model.settings.zeroed_channels.end())
      variables.zeros.push_back(channel);
  check_names(variables);
  const std::string token =
      token_of(program.header + program.source + fmi_wrapper(options, variables, {}) +
               fmi_description(model, options, variables, origin, {}));
  const std::string sources = "sources/" + options.name;
  Fmu fmu{
      .name = options.name,
      .version = options.version,
      .token = token,
      .files = {{"modelDescription.xml", fmi_description(model, options, variables, origin, token)},
                {"documentation/index.html", fmi_documentation(model, options, variables, origin)},
                {sources + ".h", program.header},
                {sources + ".c", program.source},
                {sources + "_fmi.c", fmi_wrapper(options, variables, token)}}};
  if (options.version == FmiVersion::three)
    fmu.files.push_back({"sources/buildDescription.xml", fmi_build_description(options)});
  return fmu;
}

void write_fmu(const std::filesystem::path& path, const Fmu& fmu) {
  OutputFile file(path);
  ZipWriter archive(file);
  for (const FmuFile& each : fmu.files) archive.add(each.path, each.bytes);
  archive.finish();
  file.commit();
}

}  // namespace torsio
