#include "data/mapping/unit_words.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "core/lower.hpp"
#include "core/trimmed.hpp"

namespace torsio {
namespace {

struct Spelling {
  std::string_view word;  ///< in small letters, without blanks, dots and stars
  std::string_view suffix;
};

// English, German, French, Spanish, Italian, Portuguese, Dutch, Polish, Swedish, where a word has one meaning in all of
// them: not "g/min", not "U", which is a voltage in German, and not "o".
constexpr auto kSpellings = std::to_array<Spelling>({
    {"radians", "rad"},
    {"radian", "rad"},
    {"rad", "rad"},
    {"radiant", "rad"},
    {"radianes", "rad"},
    {"radianti", "rad"},
    {"degrees", "deg"},
    {"degree", "deg"},
    {"deg", "deg"},
    {"grad", "deg"},
    {"winkelgrad", "deg"},
    {"degré", "deg"},
    {"degrés", "deg"},
    {"grados", "deg"},
    {"graus", "deg"},
    {"gradi", "deg"},
    {"graden", "deg"},
    {"grader", "deg"},
    {"stopnie", "deg"},
    {"stopni", "deg"},
    {"turns", "rev"},
    {"turn", "rev"},
    {"revolutions", "rev"},
    {"revolution", "rev"},
    {"umdrehung", "rev"},
    {"umdrehungen", "rev"},
    {"umdr", "rev"},
    {"tour", "rev"},
    {"tours", "rev"},
    {"giri", "rev"},
    {"vueltas", "rev"},
    {"seconds", "s"},
    {"second", "s"},
    {"sec", "s"},
    {"sek", "s"},
    {"sekunde", "s"},
    {"sekunden", "s"},
    {"seconde", "s"},
    {"secondes", "s"},
    {"segundos", "s"},
    {"secondi", "s"},
    {"msec", "ms"},
    {"msek", "ms"},
    {"milliseconds", "ms"},
    {"millisekunden", "ms"},
    {"usec", "us"},
    {"usek", "us"},
    {"microseconds", "us"},
    {"mikrosekunden", "us"},
    {"rad/sec", "rad_s"},
    {"rad/sek", "rad_s"},
    {"deg/sec", "deg_s"},
    {"deg/sek", "deg_s"},
    {"deg/s", "deg_s"},
    {"grad/s", "deg_s"},
    {"grad/sec", "deg_s"},
    {"grad/sek", "deg_s"},
    {"degrés/s", "deg_s"},
    {"grados/s", "deg_s"},
    {"graus/s", "deg_s"},
    {"gradi/s", "deg_s"},
    {"turns/s", "rev_s"},
    {"u/s", "rev_s"},
    {"umdr/s", "rev_s"},
    {"tr/s", "rev_s"},
    {"tours/s", "rev_s"},
    {"giri/s", "rev_s"},
    {"rpm", "rpm"},
    {"rev/min", "rpm"},
    {"r/min", "rpm"},
    {"1/min", "rpm"},
    {"/min", "rpm"},
    {"min-1", "rpm"},
    {"min^-1", "rpm"},
    {"min⁻¹", "rpm"},
    {"u/min", "rpm"},
    {"umdr/min", "rpm"},
    {"umdrehungen/min", "rpm"},
    {"tr/min", "rpm"},
    {"trs/min", "rpm"},
    {"tours/min", "rpm"},
    {"giri/min", "rpm"},
    {"omw/min", "rpm"},
    {"obr/min", "rpm"},
    {"varv/min", "rpm"},
    {"amps", "A"},
    {"amp", "A"},
    {"ampere", "A"},
    {"amperes", "A"},
    {"ampère", "A"},
    {"ampères", "A"},
    {"amperios", "A"},
    {"milliampere", "mA"},
    {"volts", "V"},
    {"volt", "V"},
    {"nm", "Nm"},
    {"n-m", "Nm"},
    {"newtonmeter", "Nm"},
    {"newtonmeters", "Nm"},
    {"hz", "Hz"},
    {"celsius", "degC"},
    {"gradc", "degC"},
    {"gradcelsius", "degC"},
    {"lbfft", "lbft"},
    {"ftlb", "lbft"},
    {"ftlbf", "lbft"},
    {"lb-ft", "lbft"},
    {"lbf-ft", "lbft"},
    {"ft-lb", "lbft"},
    {"ft-lbf", "lbft"},
    {"lbfin", "lbin"},
    {"lb-in", "lbin"},
    {"lbf-in", "lbin"},
    {"in-lb", "lbin"},
    {"in-lbf", "lbin"},
    {"oz-in", "ozin"},
});

constexpr auto kCounts = std::to_array<std::string_view>(
    {"count",     "counts",     "cnt",       "cnts",       "tick",        "ticks",      "tic",
     "tics",      "inc",        "incs",      "increment",  "increments",  "ink",        "inkr",
     "inkrement", "inkremente", "incrément", "incréments", "incrementos", "incrementi", "impuls",
     "impulse",   "impulses",   "impulsion", "impulsions", "impulsos",    "impulsi",    "cuentas",
     "schritt",   "schritte",   "step",      "steps",      "lsb",         "raw",        "digit",
     "digits",    "bit",        "bits",      "adc",        "cpr",         "pulse",      "pulses",
     "imp",       "imps",       "pts"});

/// A sign, and what is written for it in ASCII.
constexpr auto kSigns = std::to_array<Spelling>({{"°", "deg"},
                                                 {"º", "deg"},  // the ordinal of Spanish keyboards
                                                 {"·", ""},
                                                 {"⋅", ""},
                                                 {"µ", "u"},
                                                 {"μ", "u"},
                                                 {"%", "pct"},
                                                 {" ", ""},
                                                 {"*", ""},
                                                 {".", ""}});

/// "N·m" as "Nm".
std::string in_ascii(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    const auto* const sign = std::ranges::find_if(
        kSigns, [&](const Spelling& each) { return text.starts_with(each.word); });
    if (sign == kSigns.end()) {
      plain += text.front();
      text.remove_prefix(1);
    } else {
      plain += sign->suffix;
      text.remove_prefix(sign->word.size());
    }
  }
  return plain;
}

}  // namespace

std::string_view without_frame(std::string_view text) {
  text = trimmed(text);
  if (text.size() >= 2 &&
      ((text.front() == '[' && text.back() == ']') || (text.front() == '(' && text.back() == ')')))
    text = trimmed(text.substr(1, text.size() - 2));
  return text;
}

std::string_view unit_spelled(std::string_view text) {
  const auto* const at = std::ranges::find(kSpellings, lower(text), &Spelling::word);
  return at == kSpellings.end() ? std::string_view() : at->suffix;
}

bool is_count(std::string_view unit) {
  std::string word = lower(unit);
  while (word.ends_with('.')) word.pop_back();  // "Ink."
  return std::ranges::find(kCounts, word) != kCounts.end();
}

bool is_gradian_or_degree(std::string_view unit) {
  const std::string word = lower(unit.substr(0, unit.find('/')));
  return word == "grad" && !unit.starts_with("Grad");
}

bool is_gradian(std::string_view unit) {
  const std::string word = lower(unit);
  return word == "gon" || word == "gradian" || word == "gradians" || word == "grades" ||
         word == "grads";
}

const Unit* unit_in_words(std::string_view written) {
  std::string_view text = without_frame(written);
  if (text.size() > 1 && text.front() == '_') text.remove_prefix(1);  // as names end: "_1"
  if (const Unit* const unit = find_written_unit(text)) return unit;
  const std::string plain = in_ascii(text);
  if (const Unit* const unit = find_written_unit(plain)) return unit;
  if (plain == "nm" || is_gradian_or_degree(plain)) return nullptr;  // nanometres, too
  return find_unit(unit_spelled(plain));
}

}  // namespace torsio
