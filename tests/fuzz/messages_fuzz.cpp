#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/ros/message_source.hpp"
#include "data/ros/message_topics.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

namespace {

/// Some messages of one channel.
class Repeated final : public torsio::MessageSource {
 public:
  Repeated(const torsio::MessageChannel& channel, std::string_view data)
      : MessageSource(torsio::ReadBudget("fuzz")), channel_(channel), data_(data) {
    budget().read_to(channel.schema.definition.size() + kMessages * data.size());
  }
  bool next(torsio::LogMessage& message) override {
    if (given_ == kMessages) return false;
    message = {.channel = &channel_, .log_time_ns = given_, .data = data_};
    ++given_;
    return true;
  }

 private:
  static constexpr int kMessages = 6;

  const torsio::MessageChannel& channel_;
  std::string_view data_;
  int given_ = 0;
};

void read(const torsio::MessageChannel& channel, std::string_view data) {
  Repeated messages(channel, data);
  const std::vector<torsio::NamedMessages> files{{"fuzz", &messages}};
  try {
    static_cast<void>(torsio::table_of_messages(files, "fuzz", {.values = 1 << 16}));
  } catch (const torsio::Error&) {
    return;
  }
}

}  // namespace

/// Any text is a message in JSON, and the text before its first zero the definition of the messages of ROS
/// that follow: a table, or an Error, within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const std::size_t zero = text.find('\0');
  const std::string definition(text.substr(0, zero));
  const std::string_view data = zero == std::string_view::npos ? "" : text.substr(zero + 1);
  torsio::fuzz::within_budget([&] {
    read({"/json", "json", {"p/msg/J", "jsonschema", ""}}, text);
    read({"/ros2", "cdr", {"p/msg/T", "ros2msg", definition}}, data);
    read({"/ros1", "ros1", {"p/T", "ros1msg", definition}}, data);
  });
  return 0;
}
