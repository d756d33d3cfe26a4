#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "data/mcap/mcap_records.hpp"

namespace torsio::test {

// Records of an MCAP file.
template <class Number>
inline std::string number(Number value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
}

inline std::string text(const std::string& value) {
  return number(static_cast<std::uint32_t>(value.size())) + value;
}

inline std::string record(char kind, const std::string& content) {
  return kind + number(static_cast<std::uint64_t>(content.size())) + content;
}

inline std::string channel(std::uint16_t id, std::uint16_t schema, const std::string& topic,
                           const std::string& encoding) {
  return record('\x04', number(id) + number(schema) + text(topic) + text(encoding) + text(""));
}

inline std::string message(std::uint16_t id, std::int64_t time_ns, const std::string& data) {
  return record('\x05',
                number(id) + number(std::uint32_t{0}) + number(time_ns) + number(time_ns) + data);
}

/// A file with one channel and one message.
inline std::string file_with(const std::string& schema_encoding, const std::string& definition,
                             const std::string& encoding, const std::string& data) {
  return std::string(kMcapMark) + record('\x01', text("") + text("")) +
         record('\x03', number(std::uint16_t{1}) + text("p/msg/T") + text(schema_encoding) +
                            text(definition)) +
         channel(1, 1, "/t", encoding) + message(1, 1000, data);
}

}  // namespace torsio::test
