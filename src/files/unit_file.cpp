#include "files/unit_file.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

UnitFile::UnitFile(std::string path, const std::string& campaign) : path_(std::move(path)) {
  if (path_.empty()) return;
  const bool is_new = !std::filesystem::exists(path_) || std::filesystem::file_size(path_) == 0;
  if (!is_new) read(campaign);
  out_.open(path_, std::ios::binary | std::ios::app);
  if (is_new) out_ << Json{{"campaign", Json::parse(campaign)}}.dump() << '\n' << std::flush;
  if (!out_) throw Error({.place = path_, .problem = "cannot be written"});
}

void UnitFile::read(const std::string& campaign) {
  std::string text;
  {
    std::ifstream in(path_, std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    if (!in) throw Error({.place = path_, .problem = "cannot be read"});
    text = all.str();
  }
  const auto refuse = [this](std::size_t line, std::string expected, std::string found) {
    throw Error({.place = path_ + " line " + std::to_string(line),
                 .expected = std::move(expected),
                 .found = std::move(found),
                 .advice = "Give another file, or the settings and monitors of this campaign."});
  };
  std::size_t begin = 0;
  for (std::size_t line = 1; begin < text.size(); ++line) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;
    const Json json = Json::parse(text.substr(begin, end - begin), nullptr, false);
    begin = end + 1;
    if (line == 1) {
      if (!json.is_object() || !json.contains("campaign"))
        refuse(line, "the file of a campaign", "another one");
      if (json["campaign"] != Json::parse(campaign))
        refuse(line, campaign, json["campaign"].dump());
    } else if (!json.is_object() || !json.contains("unit") || !json["unit"].is_string() ||
               !json.contains("result")) {
      refuse(line, "the result of a unit", "something else");
    } else {
      results_[json["unit"].get<std::string>()] = json["result"].dump();
    }
  }
  // What a killed run left unfinished is done again.
  if (begin < text.size()) std::filesystem::resize_file(path_, begin);
  if (begin == 0) refuse(1, "the file of a campaign", "no complete line");
}

const std::string* UnitFile::find(const std::string& unit) const {
  const auto found = results_.find(unit);
  return found == results_.end() ? nullptr : &found->second;
}

void UnitFile::add(const std::string& unit, const std::string& result) {
  if (path_.empty()) return;
  const std::scoped_lock lock(guard_);
  out_ << Json{{"unit", unit}, {"result", Json::parse(result)}}.dump() << '\n' << std::flush;
  if (!out_) throw Error({.place = path_, .problem = "cannot be written; is the disk full?"});
}

}  // namespace torsio
