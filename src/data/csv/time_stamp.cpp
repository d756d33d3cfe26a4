#include "data/csv/time_stamp.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <system_error>
#include <vector>

#include "core/text_cursor.hpp"
#include "core/trimmed.hpp"

namespace torsio {
namespace {

constexpr double kDay_s = 86400.0;
constexpr double kHour_s = 3600.0;
constexpr double kMinute_s = 60.0;

bool is_latin_letter(char c) noexcept { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// Whether a word is the English name of a month, or its first three letters.
bool is_month(std::string_view word) {
  constexpr std::array<std::string_view, 12> kMonths{
      "january", "february", "march",     "april",   "may",      "june",
      "july",    "august",   "september", "october", "november", "december"};
  constexpr std::size_t kShort = 3;
  const auto is_alike = [](char a, char b) { return (a | 0x20) == b; };
  return std::ranges::any_of(kMonths, [&](std::string_view month) {
    return std::ranges::equal(word, month, is_alike) ||
           std::ranges::equal(word, month.substr(0, kShort), is_alike);
  });
}

/// The letters, or the digits, at the beginning of a text; its first character if that is neither.
std::string_view first_part(std::string_view text) noexcept {
  const auto same = is_digit(text.front()) ? is_digit : is_latin_letter;
  const auto* const end = std::ranges::find_if_not(text, same);
  return text.substr(0, std::max<std::size_t>(static_cast<std::size_t>(end - text.begin()), 1));
}

bool has_month(std::string_view text) {
  while (!text.empty()) {
    const std::string_view part = first_part(text);
    if (is_month(part)) return true;
    text.remove_prefix(part.size());
  }
  return false;
}

/// Reads parts of a text from its beginning.
class TimeText {
 public:
  explicit TimeText(std::string_view text) : left_(text) {}

  [[nodiscard]] bool is_at_end() const noexcept { return left_.empty(); }
  [[nodiscard]] std::string_view left() const noexcept { return left_; }
  bool take(char c) noexcept {
    if (!left_.starts_with(c)) return false;
    left_.remove_prefix(1);
    return true;
  }
  bool take(std::string_view word) noexcept {
    if (!left_.starts_with(word)) return false;
    left_.remove_prefix(word.size());
    return true;
  }
  /// From `least` to `most` digits. @returns -1, with nothing taken, if there are fewer
  int number(std::size_t least, std::size_t most) noexcept {
    std::size_t size = 0;
    int value = 0;
    for (; size < std::min(most, left_.size()) && is_digit(left_[size]); ++size)
      value = 10 * value + (left_[size] - '0');
    if (size < least) return -1;
    left_.remove_prefix(size);
    return value;
  }
  /// ".25" or ",25"; 0 if there is none.
  double fraction() noexcept {
    if (left_.size() < 2 || (left_[0] != '.' && left_[0] != ',') || !is_digit(left_[1])) return 0.0;
    left_.remove_prefix(1);
    double value = 0.0;
    double digits = 1.0;
    constexpr double kMaxDigits = 1e15;
    for (; !left_.empty() && is_digit(left_.front()); left_.remove_prefix(1)) {
      if (digits >= kMaxDigits) continue;
      value = 10.0 * value + (left_.front() - '0');
      digits *= 10.0;
    }
    return value / digits;
  }
  /// ":250", as some loggers write the fraction; 0 if it is not that.
  double milliseconds() noexcept {
    constexpr std::size_t kDigits = 3;
    TimeText ahead = *this;
    if (!ahead.take(':')) return 0.0;
    const int value = ahead.number(kDigits, kDigits);
    if (value < 0) return 0.0;
    *this = ahead;
    return 1e-3 * value;
  }
  void skip_blanks() noexcept {
    while (take(' ')) {
    }
  }

 private:
  std::string_view left_;
};

std::optional<double> days_of(int year, int month, int day) {
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (year < 0 || month < 0 || day < 0 || !date.ok()) return std::nullopt;
  return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
}

/// 2024-03-01, 2024/03/01, 01.03.2024, 20240301T
std::optional<double> take_date(TimeText& text) {
  TimeText ahead = text;
  const int first = ahead.number(1, 4);
  std::optional<double> days;
  for (const char separator : {'-', '/', '.'}) {
    if (!ahead.take(separator)) continue;
    const int month = ahead.number(1, 2);
    if (!ahead.take(separator)) return std::nullopt;
    const int last = ahead.number(1, 4);
    constexpr int kFirstYear = 1900;
    if (separator == '.' && last >= kFirstYear)
      days = days_of(last, month, first);
    else if (first >= kFirstYear)
      days = days_of(first, month, last);
    break;
  }
  if (!days) {
    ahead = text;
    const int year = ahead.number(4, 4);
    const int month = ahead.number(2, 2);
    const int day = ahead.number(2, 2);
    if (!ahead.left().starts_with('T')) return std::nullopt;
    days = days_of(year, month, day);
  }
  if (days) text = ahead;
  return days;
}

/// 12:34:56.789, 12:34 (`with_date`), 34:56.789, 1:02:03 PM, 123456 (`with_date`)
std::optional<double> take_time(TimeText& text, bool with_date) {
  constexpr std::size_t kHourDigits = 4;  // a duration may be longer than a day
  TimeText ahead = text;
  double seconds = 0.0;
  const int first = ahead.number(1, with_date ? 2 : kHourDigits);
  if (first < 0) return std::nullopt;
  const bool is_basic = with_date && !ahead.left().starts_with(':');
  if (!is_basic && !ahead.take(':')) return std::nullopt;
  const int second = ahead.number(2, 2);
  if (second < 0 || second >= 60) return std::nullopt;
  const bool has_third =
      is_basic ? !ahead.is_at_end() && is_digit(ahead.left().front()) : ahead.take(':');
  if (has_third) {
    const int third = ahead.number(2, 2);
    if (third < 0 || third > 60) return std::nullopt;
    seconds = kHour_s * first + kMinute_s * second + third;
    seconds += ahead.left().starts_with(':') ? ahead.milliseconds() : ahead.fraction();
  } else {
    const std::size_t before = ahead.left().size();
    const double fraction = ahead.fraction();
    // 12:34 may be hours and minutes, or minutes and seconds.
    if (!with_date && ahead.left().size() == before) return std::nullopt;
    seconds =
        with_date ? kHour_s * first + kMinute_s * second : kMinute_s * first + second + fraction;
  }
  ahead.skip_blanks();
  const bool is_morning = ahead.take("AM") || ahead.take("am");
  const bool is_afternoon = !is_morning && (ahead.take("PM") || ahead.take("pm"));
  if ((is_morning || is_afternoon) && (!has_third || first < 1 || first > 12)) return std::nullopt;
  if (is_morning && first == 12) seconds -= kDay_s / 2.0;
  if (is_afternoon && first != 12) seconds += kDay_s / 2.0;
  if (with_date && first > 24) return std::nullopt;
  text = ahead;
  return seconds;
}

/// "Z", "+01:00", "-0130", "UTC"; its offset. Nothing if there is none.
std::optional<double> take_zone(TimeText& text) {
  if (text.take('Z') || text.take('z') || text.take("UTC") || text.take("GMT")) return 0.0;
  const bool is_west = text.left().starts_with('-');
  if (!is_west && !text.left().starts_with('+')) return std::nullopt;
  text.take(text.left().front());
  const int hours = text.number(2, 2);
  text.take(':');
  const int minutes = std::max(text.number(2, 2), 0);
  if (hours < 0 || hours > 24 || minutes >= 60) return std::nullopt;
  return (is_west ? -1.0 : 1.0) * (kHour_s * hours + kMinute_s * minutes);
}

/// Whether one of the letters is a place in a format: "%H".
bool has_place(std::string_view format, std::string_view letters) {
  for (std::size_t i = 0; i + 1 < format.size(); ++i)
    if (format[i] == '%' && letters.find(format[++i]) != std::string_view::npos) return true;
  return false;
}

/// "3 days 00:00:01.5", as pandas writes durations.
std::optional<TimeStamp> read_days(std::string_view text) {
  TimeText parts(text);
  const int days = parts.number(1, 6);
  if (days < 0 || !(parts.take(" days") || parts.take(" day"))) return std::nullopt;
  parts.skip_blanks();
  const auto time = parts.is_at_end() ? std::optional(0.0) : take_time(parts, false);
  if (!time || !parts.is_at_end()) return std::nullopt;
  return TimeStamp{.kind = TimeKind::time_of_day, .time_s = kDay_s * days + *time};
}

/// "0.002 sec", as MATLAB writes durations in tables.
std::optional<TimeStamp> read_duration(std::string_view text) {
  struct Ending {
    std::string_view ending;
    double unit_s;
  };
  constexpr auto kEndings =
      std::to_array<Ending>({{" sec", 1.0}, {" min", kMinute_s}, {" hr", kHour_s}});
  for (const auto& [ending, unit_s] : kEndings) {
    if (!text.ends_with(ending)) continue;
    double number = 0.0;
    const char* const end = text.data() + text.size() - ending.size();
    const auto [after, code] = std::from_chars(text.data(), end, number);
    if (code != std::errc{} || after != end) return std::nullopt;
    return TimeStamp{.kind = TimeKind::time_of_day, .time_s = unit_s * number};
  }
  return std::nullopt;
}

}  // namespace

std::optional<TimeStamp> read_time_stamp(std::string_view text) {
  const std::string_view whole = trimmed(text);
  if (whole.empty() || !is_digit(whole.front())) return std::nullopt;
  if (const auto duration = read_duration(whole)) return duration;
  if (const auto duration = read_days(whole)) return duration;
  TimeText parts(whole);
  const auto days = take_date(parts);
  if (days && parts.is_at_end()) return TimeStamp{.kind = TimeKind::date, .time_s = kDay_s * *days};
  if (days && !parts.take('T') && !parts.take('t') && !parts.take(' ') && !parts.take('_'))
    return std::nullopt;
  parts.skip_blanks();
  const auto time = take_time(parts, days.has_value());
  if (!time) return std::nullopt;
  TimeStamp stamp{.kind = days ? TimeKind::date_time : TimeKind::time_of_day,
                  .time_s = kDay_s * days.value_or(0.0) + *time};
  if (!parts.is_at_end()) {
    const auto zone = take_zone(parts);
    if (!zone || !parts.is_at_end()) return std::nullopt;
    stamp.has_zone = true;
    stamp.time_s -= *zone;
  }
  return stamp;
}

std::optional<TimeStamp> read_time_stamp(std::string_view text, const std::string& format) {
  std::string left(trimmed(text));
  double fraction = 0.0;
  for (std::size_t at = left.find_first_of(".,"); at != std::string::npos;
       at = left.find_first_of(".,", at + 1)) {
    const bool is_after_seconds =
        at >= 3 && left[at - 3] == ':' && is_digit(left[at - 2]) && is_digit(left[at - 1]);
    if (!is_after_seconds) continue;
    TimeText rest(std::string_view(left).substr(at));
    fraction = rest.fraction();
    left.erase(at, left.size() - at - rest.left().size());
    break;
  }
  std::tm parts{};
  parts.tm_mday = 1;
  parts.tm_year = 70;
  const char* const end = strptime(left.c_str(), format.c_str(), &parts);
  if (end == nullptr || *end != '\0') return std::nullopt;
  const auto days = days_of(parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
  if (!days) return std::nullopt;
  const double of_day_s = kHour_s * parts.tm_hour + kMinute_s * parts.tm_min + parts.tm_sec;
  const bool has_time = has_place(format, "HIMSTRcrs");
  const bool has_date = has_place(format, "yYdDjexFcs");
  const TimeKind kind = !has_time  ? TimeKind::date
                        : has_date ? TimeKind::date_time
                                   : TimeKind::time_of_day;
  return TimeStamp{
      .kind = kind,
      .time_s = kDay_s * *days + of_day_s + fraction - static_cast<double>(parts.tm_gmtoff),
      .has_zone = has_place(format, "zs")};
}

bool is_like_time(std::string_view text) noexcept {
  constexpr std::ptrdiff_t kLeastDigits = 3;
  constexpr std::ptrdiff_t kLeastSize = 5;
  constexpr std::size_t kMaxSize = 40;
  const auto digits = std::ranges::count_if(text, is_digit);
  if (text.size() > kMaxSize || digits < kLeastDigits) return false;
  if (has_month(text)) return true;
  const auto marks = std::ranges::count_if(text, [](char c) { return c == ':' || c == '/'; });
  const auto points = std::ranges::count(text, '.');
  return (marks >= 1 && digits + marks >= kLeastSize) ||
         (points >= 2 && digits + points > kLeastSize);
}

std::string likely_time_format(std::string_view text) {
  const bool has_halves = text.ends_with('M') || text.ends_with('m');  // AM, PM
  std::vector<std::string_view> of_day{has_halves ? "%I" : "%H", "%M", "%S"};
  std::vector<std::string_view> of_date{"%m", "%d", "%y"};
  if (std::ranges::count(text, '.') >= 2) of_date = {"%d", "%m", "%y"};
  if (has_month(text)) std::erase(of_date, "%m");
  std::string format;
  const auto take = [&](std::vector<std::string_view>& places) {
    if (places.empty()) return;
    format += places.front();
    places.erase(places.begin());
  };
  for (std::string_view left = text; !left.empty();) {
    const std::string_view part = first_part(left);
    const bool is_of_day = format.ends_with(':') || left.substr(part.size()).starts_with(':');
    left.remove_prefix(part.size());
    if (is_month(part)) {
      format += "%b";
    } else if (is_latin_letter(part.front()) && part.size() >= 2) {
      format += has_halves && left.empty() ? "%p" : "%a";
    } else if (!is_digit(part.front())) {
      format += part;  // a mark between the parts
    } else if (is_of_day) {
      take(of_day);
    } else if (format.ends_with("%S.") || format.ends_with("%S,")) {
      format.pop_back();  // a fraction is read without a place
    } else if (part.size() == 4) {
      format += "%Y";
      std::erase(of_date, "%y");
    } else {
      take(of_date);
    }
  }
  return format;
}

}  // namespace torsio
