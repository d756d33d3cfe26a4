#include "search/scored_model_text.hpp"

#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Json = nlohmann::json;

[[noreturn]] void refuse_stored() {
  throw Error({.place = "store",
               .problem = "a stored result is damaged or of another version of torsio",
               .advice = "Begin the study again under another name."});
}

/// JSON has no numbers for NaN and the infinities.
Json exact(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

void read(const Json& json, double& value) {
  if (json.is_number()) {
    value = json.get<double>();
  } else if (json == "nan") {
    value = kNotMeasured;
  } else if (json == "inf" || json == "-inf") {
    value = std::numeric_limits<double>::infinity() * (json == "inf" ? 1.0 : -1.0);
  } else {
    refuse_stored();
  }
}
void read(const Json& json, std::size_t& value) { value = json.get<std::size_t>(); }

/// Calls `visit(name, field)` for each number of a row: the one list for writing and reading.
template <class Row, class Visit>
void visit_numbers(Row& row, const Visit& visit) {
  const auto metrics = [&](const std::string& prefix, auto& of) {
    visit(prefix + "samples", of.samples);
    visit(prefix + "rmse", of.rmse);
    visit(prefix + "mad", of.mad);
    visit(prefix + "std_abs", of.std_abs);
    visit(prefix + "max_abs", of.max_abs);
    visit(prefix + "fit_percent", of.fit_percent);
  };
  metrics("", row.score.metrics);
  metrics("one_step_", row.score.one_step);
  visit("initialised_samples", row.score.initialised_samples);
  visit("guarded_samples", row.score.guarded_samples);
  visit("diverged_samples", row.score.diverged_samples);
  visit("within_std_dev", row.score.within_std_dev);
  visit("within_2_std_dev", row.score.within_2_std_dev);
  visit("mean_std_dev", row.score.mean_std_dev);
  visit("without_std_dev", row.score.without_std_dev);
  visit("step_ns_p50", row.score.step_ns_p50);
  visit("step_ns_p999", row.score.step_ns_p999);
  visit("fit_seconds", row.fit_seconds);
  visit("parameter_count", row.parameter_count);
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// Takes a value from the front of the bytes.
template <class T>
T take(std::string_view& bytes) {
  if (bytes.size() < sizeof(T)) refuse_stored();
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  bytes.remove_prefix(sizeof(T));
  return value;
}

}  // namespace

std::string rows_text(const std::vector<ResultRow>& rows) {
  Json document = Json::array();
  for (const ResultRow& row : rows) {
    Json json{{"split", static_cast<int>(row.split)},
              {"status", row.status},
              {"reason", row.reason},
              {"leak", row.leak}};
    if (row.recording) json["recording"] = *row.recording;
    visit_numbers(row, [&](const std::string& name, const auto& value) {
      if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>)
        json[name] = exact(value);
      else
        json[name] = value;
    });
    document.push_back(std::move(json));
  }
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::vector<ResultRow> rows_from_text(std::string_view text) {
  std::vector<ResultRow> rows;
  try {
    for (const Json& json : Json::parse(text)) {
      ResultRow row;
      row.split = static_cast<Role>(json.at("split").get<int>());
      row.status = json.at("status");
      row.reason = json.at("reason");
      row.leak = json.at("leak");
      if (json.contains("recording")) row.recording = json["recording"].get<std::string>();
      visit_numbers(row, [&](const std::string& name, auto& value) { read(json.at(name), value); });
      rows.push_back(std::move(row));
    }
  } catch (const Json::exception&) {
    refuse_stored();
  }
  return rows;
}

TrialResult trial_result(const std::vector<ResultRow>& rows) {
  TrialResult result{.result = rows_text(rows)};
  const auto total = std::ranges::find_if(
      rows, [](const ResultRow& row) { return row.split == Role::test && !row.recording; });
  result.is_failed = total == rows.end() || total->status != "ok";
  if (result.is_failed)
    result.reason = (total == rows.end() ? rows.back() : *total).reason;
  else
    result.value = total->score.metrics.rmse;
  return result;
}

std::string pack_estimates(const std::vector<MeasuredEstimates>& recordings) {
  std::string plain;
  append(plain, static_cast<std::uint64_t>(recordings.size()));
  for (const MeasuredEstimates& recording : recordings) {
    append(plain, static_cast<std::uint64_t>(recording.values.size()));
    for (const double value : recording.values) append(plain, std::bit_cast<std::uint64_t>(value));
    for (const bool guarded : recording.guarded) plain += guarded ? '\1' : '\0';
  }
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1);
  if (ZSTD_isError(size) != 0) throw Error({.problem = "estimates could not be compressed"});
  packed.resize(size);
  return packed;
}

std::vector<MeasuredEstimates> unpack_estimates(std::string_view bytes) {
  constexpr unsigned long long kMaxBytes = 1ULL << 34;
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size > kMaxBytes) refuse_stored();  // also the values for an unknown size
  std::string plain(static_cast<std::size_t>(size), '\0');
  if (ZSTD_decompress(plain.data(), plain.size(), bytes.data(), bytes.size()) != plain.size())
    refuse_stored();
  std::string_view rest = plain;
  std::vector<MeasuredEstimates> recordings;
  for (auto count = take<std::uint64_t>(rest); count > 0; --count) {
    const auto samples = take<std::uint64_t>(rest);
    if (samples > rest.size() / (sizeof(double) + 1)) refuse_stored();
    MeasuredEstimates& recording = recordings.emplace_back();
    recording.values.reserve(samples);
    recording.guarded.reserve(samples);
    for (std::uint64_t n = 0; n < samples; ++n)
      recording.values.push_back(std::bit_cast<double>(take<std::uint64_t>(rest)));
    for (std::uint64_t n = 0; n < samples; ++n) recording.guarded.push_back(take<char>(rest) != 0);
  }
  return recordings;
}

}  // namespace torsio
