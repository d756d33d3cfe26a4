#pragma once

#include <fstream>
#include <map>
#include <mutex>
#include <string>

namespace torsio {

/// Results of units of work, one JSON document per line, so that an interrupted campaign continues. The first
/// line identifies the campaign. A last line without its end, of a run that was killed, is cut off.
class UnitFile {
 public:
  /// @param path empty: nothing is kept
  /// @throws Error if the file is of another campaign or cannot be read or written.
  UnitFile(std::string path, const std::string& campaign);

  /// The result of a unit, as it was added; null if it is not in the file.
  [[nodiscard]] const std::string* find(const std::string& unit) const;
  /// Thread-safe. @throws Error if it cannot be written.
  void add(const std::string& unit, const std::string& result);

 private:
  void read(const std::string& campaign);

  std::string path_;
  std::map<std::string, std::string> results_;
  std::ofstream out_;
  std::mutex guard_;
};

}  // namespace torsio
