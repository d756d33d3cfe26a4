// The order of folders and libraries: docs/development/architecture.md lists the folders, src/CMakeLists.txt which
// library uses which.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "docs/source_tree.hpp"
#include "support/file_bytes.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

using test::file_bytes;
using test::kRoot;

std::vector<std::string> matches(const std::string& text, const char* pattern) {
  std::vector<std::string> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator at(text.begin(), text.end(), regex); at != std::sregex_iterator(); ++at)
    found.push_back((*at)[1].str());
  return found;
}

/// A row of the table: folders that come at the same place.
struct Place {
  std::size_t row = 0;
  std::string library;
};

/// Folders and the libraries that each library uses, with all that these use.
struct Layers {
  std::map<std::string, Place> folders = {};
  std::map<std::string, std::set<std::string>> uses = {};

  /// The folder of the table in which a file is, given by its path below src or include/torsio; empty: none.
  [[nodiscard]] std::string folder_of(const fs::path& file) const {
    for (fs::path folder = file.parent_path(); !folder.empty(); folder = folder.parent_path())
      if (folders.contains(folder.string())) return folder.string();
    return {};
  }

  /// Whether the file is the header in which a user of a library starts: include/torsio/<library>.hpp.
  [[nodiscard]] bool is_start(const std::string& file) const {
    return !fs::path(file).has_parent_path() && uses.contains(fs::path(file).stem().string());
  }

  /// Why `file` may not include `included`, both below src or include/torsio; empty: it may.
  [[nodiscard]] std::string objection(const std::string& file, const std::string& included) const {
    const std::string from = folder_of(file);
    const std::string to = folder_of(included);
    if (is_start(file) && !to.empty()) {
      const std::string library = fs::path(file).stem().string();
      const std::string& used = folders.at(to).library;
      if (used == library || uses.at(library).contains(used)) return {};
      return file + " includes " + included + ": " + library + " does not link " + used;
    }
    if (from.empty()) return file + " is in no folder of docs/development/architecture.md";
    if (to.empty())
      return file + " includes " + included + ", in no folder of docs/development/architecture.md";
    const Place& user = folders.at(from);
    const Place& used = folders.at(to);
    if (used.row > user.row)
      return file + " includes " + included + ": " + to + " is below " + from;
    if (used.library != user.library && !uses.at(user.library).contains(used.library))
      return file + " includes " + included + ": " + user.library + " does not link " +
             used.library;
    return {};
  }
};

Layers layers() {
  Layers layers;
  std::ifstream table(kRoot / "docs/development/architecture.md");
  std::size_t row = 0;
  for (std::string line; std::getline(table, line); ++row) {
    std::smatch cells;
    if (!std::regex_match(line, cells, std::regex(R"(\| (`[^|]+`) \| ([a-z]+) \| .*)"))) continue;
    for (const std::string& folder : matches(cells[1].str(), "`([^`]+)`"))
      layers.folders[folder] = {.row = row, .library = cells[2].str()};
  }
  layers.uses = {{"runtime", {}},           {"files", {"runtime"}},
                 {"realtime", {"runtime"}}, {"arm", {"files", "runtime"}},
                 {"link", {"runtime"}},     {"live", {"link", "runtime"}},
                 {"mujoco", {"runtime"}}};
  const std::string cmake = file_bytes(kRoot / "src/CMakeLists.txt");
  const std::regex library(R"(torsio_slow_library\((\w+)\s[^)]*?USES ([a-z ]+))");
  for (std::sregex_iterator at(cmake.begin(), cmake.end(), library); at != std::sregex_iterator();
       ++at) {
    std::set<std::string>& uses = layers.uses[(*at)[1].str()];
    for (const std::string& name : matches((*at)[2].str(), "([a-z]+)")) {
      uses.insert(name);
      uses.merge(std::set(layers.uses.at(name)));
    }
  }
  return layers;
}

std::vector<std::string> objections(const Layers& layers) {
  std::vector<std::string> found;
  for (const fs::path& root : {kRoot / "src", kRoot / "include/torsio"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".hpp" && extension != ".cpp") continue;
      const std::string file = fs::relative(entry.path(), root).string();
      for (std::string included :
           matches(file_bytes(entry.path()), R"re(#include "(?:torsio/)?([^"]+/[^"]+)")re")) {
        const std::string objection = layers.objection(file, included);
        if (!objection.empty()) found.push_back(objection);
      }
    }
  return found;
}

TEST(Layers, NoFolderIncludesOneBelowIt) { EXPECT_THAT(objections(layers()), IsEmpty()); }

TEST(Layers, AreThoseOfTheTable) {
  const Layers found = layers();
  EXPECT_EQ(found.folder_of("fit/grey_box/fit_grey_box.cpp"), "fit/grey_box");
  EXPECT_EQ(found.folder_of("data/csv/csv.cpp"), "data");
  EXPECT_EQ(found.folders.at("core").library, "runtime");
  EXPECT_THAT(found.uses.at("learn"), ElementsAre("arm", "data", "files", "realtime", "runtime"));
  EXPECT_THAT(found.uses.at("bench"),
              ElementsAre("arm", "data", "files", "link", "realtime", "runtime"));
  EXPECT_TRUE(found.uses.at("coupling").contains("trials"));
}

TEST(Layers, NameWhatClimbs) {
  const Layers found = layers();
  EXPECT_EQ(found.objection("fit/train_model.cpp", "data/dataset.hpp"), "");
  EXPECT_EQ(found.objection("model/network/mlp.cpp", "model/any_model.hpp"),
            "model/network/mlp.cpp includes model/any_model.hpp: model is below model/network");
  EXPECT_EQ(found.objection("sim/bench/bench.cpp", "fit/families.hpp"),
            "sim/bench/bench.cpp includes fit/families.hpp: bench does not link learn");
  EXPECT_EQ(found.objection("control/pid.cpp", "files/model_file.hpp"),
            "control/pid.cpp includes files/model_file.hpp: files is below control");
  EXPECT_EQ(found.objection("learn.hpp", "files/model_file.hpp"), "");
  EXPECT_EQ(found.objection("learn.hpp", "sim/faults/fault_schedule.hpp"),
            "learn.hpp includes sim/faults/fault_schedule.hpp: learn does not link bench");
  EXPECT_EQ(found.objection("spare/pid.cpp", "core/error.hpp"),
            "spare/pid.cpp is in no folder of docs/development/architecture.md");
}

}  // namespace
}  // namespace torsio
