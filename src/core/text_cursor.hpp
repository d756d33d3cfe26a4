#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>

namespace torsio {

// Not <cctype>: what people write in a model or an option does not depend on a locale.
constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
constexpr bool is_letter(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
constexpr bool is_word_character(char c) noexcept { return is_letter(c) || is_digit(c); }
constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
constexpr bool is_printable(char c) noexcept { return c >= ' ' && c <= '~'; }

/// On one line, as a message may show it.
inline std::string on_one_line(std::string_view text) {
  std::string result(text);
  std::ranges::replace_if(
      result, [](char c) { return !is_printable(c); }, '?');
  return result;
}

/// What a text begins with, if that is a number.
struct NumberText {
  std::string_view text;  ///< empty if it is none
  double value = 0.0;
  bool fits = false;  ///< false also for a number that no double can hold
};

inline NumberText leading_number(std::string_view text) noexcept {
  NumberText number;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number.value);
  number.text = text.substr(0, static_cast<std::size_t>(end - text.data()));
  number.fits = code == std::errc{};
  return number;
}

/// A text that is read from left to right. A word is made of letters, digits and '_'.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text) noexcept : text_(text) {}

  [[nodiscard]] std::string_view text() const noexcept { return text_; }
  [[nodiscard]] std::size_t position() const noexcept { return position_; }
  /// From an earlier position to here.
  [[nodiscard]] std::string_view since(std::size_t start) const noexcept {
    return text_.substr(start, position_ - start);
  }

  void skip(std::string_view taken) noexcept { position_ += taken.size(); }
  void skip_blanks() noexcept {
    while (position_ < text_.size() && is_blank(text_[position_])) ++position_;
  }
  void return_to(std::size_t position) noexcept { position_ = position; }

  /// These skip blanks first.
  [[nodiscard]] bool at_end() noexcept {
    skip_blanks();
    return position_ == text_.size();
  }
  /// 0 at the end.
  [[nodiscard]] char next() noexcept { return at_end() ? '\0' : text_[position_]; }
  [[nodiscard]] bool next_is(char c) noexcept { return !at_end() && text_[position_] == c; }
  bool take(char c) noexcept {
    if (!next_is(c)) return false;
    ++position_;
    return true;
  }
  /// Empty if no word follows.
  [[nodiscard]] std::string_view next_word() noexcept {
    skip_blanks();
    std::size_t end = position_;
    while (end < text_.size() && is_word_character(text_[end])) ++end;
    return text_.substr(position_, end - position_);
  }
  std::string_view take_word() noexcept {
    const std::string_view word = next_word();
    skip(word);
    return word;
  }
  /// A word or one character; empty at the end.
  [[nodiscard]] std::string_view next_token() noexcept {
    const std::string_view word = next_word();
    return word.empty() ? text_.substr(position_, 1) : word;
  }
  [[nodiscard]] NumberText next_number() noexcept {
    skip_blanks();
    return leading_number(text_.substr(position_));
  }

 private:
  std::string_view text_;
  std::size_t position_ = 0;
};

}  // namespace torsio
