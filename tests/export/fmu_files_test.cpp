// The files of an FMU: description, archive, compiled library, and what is refused.

#include <dlfcn.h>
#include <expat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "data/arrays/placed_bytes.hpp"
#include "data/arrays/zip_archive.hpp"
#include "data/read_budget.hpp"
#include "export/exported_families.hpp"
#include "support/error_message.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/fmu.hpp"

namespace torsio::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes = {};
};

/// All elements in their order; a failure if the text is not well formed.
std::vector<XmlElement> xml_elements(const std::string& text) {
  std::vector<XmlElement> elements;
  XML_Parser parser = XML_ParserCreate("UTF-8");
  XML_SetUserData(parser, &elements);
  XML_SetElementHandler(
      parser,
      [](void* all, const XML_Char* name, const XML_Char** attributes) {
        auto& element = static_cast<std::vector<XmlElement>*>(all)->emplace_back(XmlElement{name});
        for (; *attributes != nullptr; attributes += 2)
          element.attributes[attributes[0]] = attributes[1];
      },
      [](void*, const XML_Char*) {});
  EXPECT_NE(XML_Parse(parser, text.data(), static_cast<int>(text.size()), 1), XML_STATUS_ERROR)
      << XML_ErrorString(XML_GetErrorCode(parser)) << " in line "
      << XML_GetCurrentLineNumber(parser);
  XML_ParserFree(parser);
  return elements;
}

std::string fmu_file(const Fmu& fmu, const std::string& path) {
  for (const FmuFile& file : fmu.files)
    if (file.path == path) return file.bytes;
  ADD_FAILURE() << path;
  return {};
}

Fmu linear_fmu(FmiVersion version) {
  return make_fmu(example_model_file(AnyModel(example<Linear>())), {.version = version}, "x");
}

TEST(FmuFiles, DescribeVariablesWithUnitsAndFaults) {
  for (const FmiVersion version : {FmiVersion::two, FmiVersion::three}) {
    const bool is_two = version == FmiVersion::two;
    const Fmu fmu = linear_fmu(version);
    std::set<std::string> units;
    std::vector<std::string> names;
    std::vector<std::string> used_units;
    std::map<std::string, std::string> faults;
    std::size_t outputs = 0;
    for (const auto& [name, attributes] : xml_elements(fmu_file(fmu, "modelDescription.xml"))) {
      if (name == "fmiModelDescription") {
        EXPECT_EQ(attributes.at("fmiVersion"), is_two ? "2.0" : "3.0");
        EXPECT_EQ(attributes.at(is_two ? "guid" : "instantiationToken"), fmu.token);
      }
      if (name == "CoSimulation") {
        EXPECT_EQ(attributes.at("modelIdentifier"), "joint");
        EXPECT_EQ(attributes.at(is_two ? "canGetAndSetFMUstate" : "canGetAndSetFMUState"), "true");
        if (!is_two) {
          EXPECT_EQ(attributes.at("fixedInternalStepSize"), "0.001");
        }
      }
      if (name == "DefaultExperiment") {
        EXPECT_EQ(attributes.at("stepSize"), "0.001");
      }
      if (name == "Unit") {
        EXPECT_TRUE(units.insert(attributes.at("name")).second);
      }
      if (name == "Item") faults[attributes.at("value")] = attributes.at("name");
      if (attributes.contains("causality")) {
        EXPECT_EQ(attributes.at("valueReference"), std::to_string(names.size()));
        names.push_back(attributes.at("name"));
        if (attributes.at("causality") == "output") ++outputs;
      }
      if (attributes.contains("unit")) used_units.push_back(attributes.at("unit"));
    }
    EXPECT_THAT(names, ElementsAre("time", "gear_angle_rad", "joint_angle_rad",
                                   "zero_joint_angle_rad", "torque_Nm", "std_dev", "fault"));
    EXPECT_THAT(used_units, ElementsAre("s", "rad", "rad", "rad", "Nm", "Nm"));
    for (const std::string& unit : used_units) EXPECT_TRUE(units.contains(unit)) << unit;
    EXPECT_EQ(outputs, 3U);
    EXPECT_EQ(faults.at("0"), "none");
    EXPECT_EQ(faults.at("4"), "zero_not_set");
    EXPECT_EQ(faults.size(), kFaultCount);
  }
}

TEST(FmuFiles, NameTheSources) {
  for (const FmiVersion version : {FmiVersion::two, FmiVersion::three}) {
    const bool is_two = version == FmiVersion::two;
    const Fmu fmu = linear_fmu(version);
    std::vector<std::string> sources;
    for (const auto& [name, attributes] : xml_elements(
             fmu_file(fmu, is_two ? "modelDescription.xml" : "sources/buildDescription.xml")))
      if (name == (is_two ? "File" : "SourceFile")) sources.push_back(attributes.at("name"));
    EXPECT_THAT(sources, ElementsAre("joint.c", "joint_fmi.c"));
    for (const std::string& source : sources) EXPECT_NE(fmu_file(fmu, "sources/" + source), "");
    EXPECT_NE(fmu_file(fmu, "sources/joint.h"), "");
    EXPECT_THAT(fmu_file(fmu, "documentation/index.html"), HasSubstr("zero_joint_angle_rad"));
  }
}

TEST(FmuFiles, TextsOfACardAreEscaped) {
  ModelFile file = example_model_file(AnyModel(example<Linear>()));
  file.card.held_out = "\"/> <x a='&lt;\n\x01\xff";
  file.card.options["degree"] = "</fmiModelDescription>";
  for (const FmiVersion version : {FmiVersion::two, FmiVersion::three}) {
    const Fmu fmu = make_fmu(file, {.version = version}, "a\"b<c&d\xC3\xBC");
    const auto elements = xml_elements(fmu_file(fmu, "modelDescription.xml"));
    EXPECT_THAT(elements.front().attributes.at("description"), HasSubstr("</fmiModelDescription>"));
    EXPECT_THAT(elements.front().attributes.at("description"), HasSubstr("a\"b<c&d"));
    for (const auto& element : elements) EXPECT_NE(element.name, "x");
  }
}

TEST(FmuFiles, AreTheSameForTheSameModelAlone) {
  EXPECT_EQ(linear_fmu(FmiVersion::three).token, linear_fmu(FmiVersion::three).token);
  std::set<std::string> tokens{linear_fmu(FmiVersion::two).token,
                               linear_fmu(FmiVersion::three).token};
  ModelFile file = example_model_file(AnyModel(example<Linear>()));
  file.settings.fallback.intercept += 1e-9;
  tokens.insert(make_fmu(file, {}, "x").token);
  tokens.insert(make_fmu(file, {.real = CReal::single}, "x").token);
  EXPECT_EQ(tokens.size(), 4U);
  EXPECT_EQ(tokens.begin()->size(), 38U);
}

TEST(FmuFiles, AreAnArchive) {
  const TemporaryFolder folder;
  const Fmu fmu = linear_fmu(FmiVersion::three);
  const std::string path = folder.path("joint.fmu");
  write_fmu(path, fmu);
  write_fmu(folder.path("again.fmu"), fmu);
  const std::string bytes = file_bytes(path);
  EXPECT_EQ(bytes, file_bytes(folder.path("again.fmu")));
  const auto placed = placed_bytes(bytes);
  ReadBudget budget("joint.fmu");
  const ZipArchive archive(*placed, budget);
  ASSERT_EQ(archive.members().size(), fmu.files.size());
  for (std::size_t i = 0; i < fmu.files.size(); ++i) {
    EXPECT_EQ(archive.members()[i].name, fmu.files[i].path);
    EXPECT_EQ(archive.read(archive.members()[i]), fmu.files[i].bytes);
  }
  if (std::filesystem::exists("/usr/bin/python3")) {
    EXPECT_EQ(std::system(("/usr/bin/python3 -m zipfile -t " + path + " > /dev/null").c_str()), 0);
  }
  EXPECT_THAT(error_message([&] { write_fmu(folder.path("no/such/joint.fmu"), fmu); }),
              HasSubstr("no/such"));
}

TEST(FmuFiles, HaveALibraryForTheMachineOfTheCompiler) {
  const TemporaryFolder folder;
  Fmu fmu = linear_fmu(FmiVersion::three);
  compile_fmu(fmu, TORSIO_CC);
  EXPECT_THAT(fmu.platform, HasSubstr("-linux"));
  const std::string& bytes = fmu_file(fmu, "binaries/" + fmu.platform + "/joint.so");
  const std::string library = folder.file("library.so", bytes);
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(handle, nullptr) << dlerror();
  EXPECT_NE(dlsym(handle, "fmi3DoStep"), nullptr);
  EXPECT_EQ(dlsym(handle, "joint_step"), nullptr);
  dlclose(handle);
}

TEST(FmuFiles, WithoutACompilerThereIsNoLibrary) {
  Fmu fmu = linear_fmu(FmiVersion::two);
  const std::size_t files = fmu.files.size();
  EXPECT_THAT(error_message([&] { compile_fmu(fmu, "no-such-compiler -O1"); }),
              HasSubstr("no-such-compiler"));
  EXPECT_THAT(error_message([&] { compile_fmu(fmu, "false"); }), HasSubstr("failed"));
  EXPECT_THAT(error_message([&] { compile_fmu(fmu, " "); }), HasSubstr("such as cc"));
  EXPECT_THAT(error_message([&] { compile_fmu(fmu, "echo arm-none-eabi"); }),
              HasSubstr("a compiler for Linux"));
  EXPECT_EQ(fmu.files.size(), files);
  EXPECT_EQ(fmu.platform, "");
}

/// The library's path in the FMU where a compiler writes the head of an ELF file, or the message.
/// @param bits, processor bytes 4 and 18 of that file, octal
std::string folder_for(FmiVersion version, const std::string& bits, const std::string& processor) {
  const TemporaryFolder folder;
  const std::string compiler =
      folder.file("compiler",
                  "#!/bin/sh\nwhile [ $# -gt 1 ]; do [ \"$1\" = -o ] && out=$2; shift; done\n"
                  "[ \"$1\" = -dumpmachine ] && echo any-linux-gnu && exit\n"
                  "printf '\\177ELF\\" +
                      bits + "\\1..........\\3\\0\\" + processor + "\\0....' > \"$out\"\n");
  std::filesystem::permissions(compiler, std::filesystem::perms::owner_all);
  Fmu fmu = linear_fmu(version);
  const std::string message = error_message([&] { compile_fmu(fmu, compiler); });
  return message.empty() ? fmu.files.back().path : message;
}

TEST(FmuFiles, HaveTheLibraryInTheFolderOfItsProcessor) {
  using enum FmiVersion;
  EXPECT_EQ(folder_for(two, "2", "76"), "binaries/linux64/joint.so");
  EXPECT_EQ(folder_for(two, "1", "3"), "binaries/linux32/joint.so");
  EXPECT_EQ(folder_for(three, "2", "76"), "binaries/x86_64-linux/joint.so");
  EXPECT_EQ(folder_for(three, "1", "3"), "binaries/x86-linux/joint.so");
  EXPECT_EQ(folder_for(three, "2", "267"), "binaries/aarch64-linux/joint.so");
  EXPECT_EQ(folder_for(three, "1", "50"), "binaries/aarch32-linux/joint.so");
  EXPECT_EQ(folder_for(three, "2", "363"), "binaries/riscv64-linux/joint.so");
  EXPECT_THAT(folder_for(two, "2", "267"), HasSubstr("--fmi 3"));
  EXPECT_THAT(folder_for(three, "2", "25"), HasSubstr("another processor"));
}

TEST(FmuFiles, AreNotWrittenForWhatIsNotExported) {
  const ModelFile file = example_model_file(AnyModel(example<Linear>()));
  for (const char* name : {"", "1joint", "a-b", "float"})
    EXPECT_THAT(error_message([&] { (void)make_fmu(file, {.name = name}, "x"); }),
                HasSubstr("C identifier"))
        << name;
  EXPECT_THAT(error_message(
                  [&] { (void)make_fmu(example_model_file(AnyModel(example<Dgmm>())), {}, "x"); }),
              HasSubstr("linear, linear_coulomb, polynomial"));
  ModelFile clash = file;
  clash.settings.target = "gear_angle_rad";
  EXPECT_THAT(error_message([&] { (void)make_fmu(clash, {}, "x"); }),
              HasSubstr("gear_angle_rad as both"));
}

}  // namespace
}  // namespace torsio::test
