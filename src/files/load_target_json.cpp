#include "files/load_target_json.hpp"

#include <vector>

namespace torsio {
namespace {

using nlohmann::ordered_json;

template <class T, class Write>
ordered_json json_list(const std::vector<T>& values, Write write) {
  ordered_json list = ordered_json::array();
  for (const T& value : values) list.push_back(write(value));
  return list;
}

}  // namespace

ordered_json load_target_json(const LoadTarget& load) {
  return {{"file", load.file},
          {"computed_from", load.computed_from},
          {"half_width_s", load.half_width_s},
          {"motion_error_Nm", load.motion_error_Nm},
          {"load_error_Nm", load.load_error_Nm},
          {"loads", json_list(load.loads,
                              [](const LoadTarget::OfRecording& of) {
                                return ordered_json{{"recording", of.recording},
                                                    {"gravity_Nm", of.gravity_Nm},
                                                    {"inertia_kg_m2", of.inertia_kg_m2},
                                                    {"zero_rad", of.zero_rad},
                                                    {"motion_error_Nm", of.motion_error_Nm}};
                              })},
          {"facts", json_list(load.facts,
                              [](const LoadTarget::OfFact& of) {
                                return ordered_json{{"fact", of.fact}, {"error_Nm", of.error_Nm}};
                              })},
          {"fitted", json_list(load.fitted, [](const LoadTarget::Fitted& of) {
             return ordered_json{
                 {"fact", of.fact}, {"value", of.value}, {"standard_error", of.standard_error}};
           })}};
}

LoadTarget load_target_of(const JsonObject& load) {
  return {
      .file = load.text("file"),
      .computed_from = load.texts("computed_from"),
      .half_width_s = load.number("half_width_s"),
      .motion_error_Nm = load.number("motion_error_Nm"),
      .load_error_Nm = load.number("load_error_Nm"),
      .loads = load.objects("loads",
                            [](const JsonObject& of) {
                              return LoadTarget::OfRecording{
                                  of.text("recording"), of.number("gravity_Nm"),
                                  of.number("inertia_kg_m2"), of.number("zero_rad"),
                                  of.number("motion_error_Nm")};
                            }),
      .facts = load.objects("facts",
                            [](const JsonObject& of) {
                              return LoadTarget::OfFact{of.text("fact"), of.number("error_Nm")};
                            }),
      .fitted = load.objects("fitted", [](const JsonObject& of) {
        return LoadTarget::Fitted{of.text("fact"), of.number("value"), of.number("standard_error")};
      })};
}

}  // namespace torsio
