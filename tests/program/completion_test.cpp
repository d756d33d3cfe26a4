// Completion in the shells themselves. Those of zsh and fish are left out where the shell is not installed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"

namespace torsio::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

class Completion : public Program {
 protected:
  bool has_shell(const std::string& name) { return shell("command -v " + name).exit_code == 0; }

  /// What a shell prints, a line each.
  static std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
};

TEST_F(Completion, OfBashHasVerbsOptionsAndValues) {
  const Outcome bash = shell("{torsio} completion bash > c && bash -n c && cat c");
  EXPECT_EQ(bash.exit_code, 0) << bash.err;
  const Outcome completed = shell(
      "bash -c '. ./c; COMP_WORDS=(torsio compare --rep); COMP_CWORD=2; _torsio; echo "
      "${COMPREPLY[@]}'");
  EXPECT_EQ(completed.out, "--report\n") << completed.err;
  const auto complete = [this](const std::string& words, int place) {
    return shell("bash -c '. ./c; COMP_WORDS=(torsio " + words +
                 "); COMP_CWORD=" + std::to_string(place) + "; _torsio; echo ${COMPREPLY[@]}'")
        .out;
  };
  EXPECT_EQ(complete("simulate dfki-28", 2),
            "dfki-28 dfki-28:maxwell-slip dfki-28:bouc-wen dfki-28:lugre\n");
  EXPECT_EQ(complete("simulate dfki-50 static", 3), "static-cycle\n");
  EXPECT_EQ(complete("fit a.csv --model grey", 4), "grey_box\n");
  EXPECT_EQ(complete("compare a.csv --models maxw", 4), "maxwell_slip\n");
  EXPECT_EQ(complete("track --actuator harmonic-drive:so", 3), "harmonic-drive:soft\n");
  EXPECT_EQ(complete("reproduce 001-mod", 2), "001-models\n");
  EXPECT_EQ(complete("design spr", 2), "spring\n");
  EXPECT_EQ(complete("fit a.c", 2), "\n") << "the shell completes files";
  // As bash divides it: at : and =.
  EXPECT_EQ(complete("simulate dfki-28 :", 3), "maxwell-slip bouc-wen lugre\n");
  EXPECT_EQ(complete("simulate dfki-28 : lu", 4), "lugre\n");
  EXPECT_EQ(complete("simulate dfki-28 : lugre static", 5), "static-cycle\n");
  EXPECT_EQ(complete("fit a.csv --model = grey", 5), "grey_box\n");
  EXPECT_EQ(complete("fit a.csv --model =", 4), complete("fit a.csv --model \"\"", 4));
  EXPECT_EQ(complete("simulate --describe dfki-28:lu", 3), "dfki-28:lugre\n");
  EXPECT_EQ(complete("simulate -o static", 3), "\n") << "a file, not an experiment";
  for (const char* shell_name : {"bash", "zsh", "fish"}) {
    const Outcome script = torsio(std::string("completion ") + shell_name);
    for (const char* word :
         {"crossvalidate", "allow-leak", "report", "grey_box", "harmonic-drive:soft"})
      EXPECT_NE(script.out.find(word), std::string::npos) << shell_name << " " << word;
  }
  EXPECT_EQ(torsio("completion tcsh").exit_code, kCallWasWrong);
}

TEST_F(Completion, OffersValuesOnlyOfOptionsThatExist) {
  const std::string script = torsio("completion bash").out;
  const std::regex case_of_option("'([a-z]+) (--[a-z-]+) '\\*\\)");
  std::size_t options = 0;
  for (std::sregex_iterator at(script.begin(), script.end(), case_of_option), end; at != end;
       ++at, ++options)
    EXPECT_NE(torsio((*at)[1].str() + " --help").out.find((*at)[2].str()), std::string::npos)
        << at->str();
  EXPECT_GT(options, 8U);
}

// zsh offers at a terminal only: it is given one, and what is offered is written to a file.
constexpr auto kZshSettings = R"(PS1=; autoload -Uz compinit; compinit -u; source ./c 2>errors
bindkey '^I' complete-word
after_completion () { print -r -- . >>offered; exit }
comppostfuncs=(after_completion)
compadd () {
  if [[ ${@[1,(i)(-|--)]} == *-(O|A|D)\ * ]]; then builtin compadd "$@"; return; fi
  local -a found; builtin compadd -A found "$@"
  (($#found)) && print -rl -- $found >>offered
  builtin compadd "$@"
}
print ready >ready
)";
constexpr auto kZshTerminal = R"(zmodload zsh/zpty
rm -f offered ready
zpty inner zsh -f -i
zpty -w inner 'source ./settings'
repeat 600 { [[ -e ready ]] && break; sleep 0.05 }
zpty -n -w inner "$1"$'\t'
repeat 600 { [[ -e offered && $(tail -n 1 offered) == . ]] && break; sleep 0.05 }
zpty -d inner
[[ -e offered ]] && grep -vxF . offered
)";

TEST_F(Completion, OfZshHasVerbsOptionsValuesAndFiles) {
  if (!has_shell("zsh")) GTEST_SKIP() << "zsh is not installed";
  (void)folder_.file("settings", kZshSettings);
  (void)folder_.file("terminal", kZshTerminal);
  (void)folder_.file("log_a.csv", "");
  ASSERT_EQ(torsio("completion zsh >c").exit_code, 0);
  EXPECT_EQ(shell("zsh -f -n c").err, "");
  EXPECT_EQ(shell("HOME=$PWD zsh -f -c 'source ./c; print $_comps[torsio]'").out, "_torsio\n")
      << "without compinit before";
  const auto complete = [this](const std::string& line) {
    const Outcome outcome = shell("HOME=$PWD TERM=xterm zsh -f terminal '" + line + "'");
    EXPECT_EQ(contents("errors"), "") << line;
    return lines_of(outcome.out);
  };
  EXPECT_THAT(complete("torsio crossv"), ElementsAre("crossvalidate"));
  EXPECT_THAT(complete("torsio --vers"), ElementsAre("--version"));
  EXPECT_THAT(complete("torsio fit --dev"), ElementsAre("--device-serial"));
  EXPECT_THAT(complete("torsio fit log_a.csv --model gre"), ElementsAre("grey_box"));
  EXPECT_THAT(complete("torsio fit log"), ElementsAre("log_a.csv"));
  EXPECT_THAT(complete("torsio fit log_a.csv log"), ElementsAre("log_a.csv"));
  EXPECT_THAT(complete("torsio simulate dfki-50 static"), ElementsAre("static-cycle"));
  EXPECT_THAT(complete("torsio simulate dfki-28:l"), ElementsAre("dfki-28:lugre"));
  EXPECT_THAT(complete("torsio simulate -o static"), IsEmpty()) << "a file, not an experiment";
  EXPECT_THAT(complete("torsio connect reco"), ElementsAre("record"));
  EXPECT_THAT(complete("torsio connect play --va"), ElementsAre("--valid"));
  EXPECT_THAT(complete("torsio fit --model=gre"), ElementsAre("grey_box"));
  // As a file of the search path of functions, which zsh runs when the name is first completed.
  ASSERT_EQ(shell("mkdir functions && cp c functions/_torsio && sed -i 's#; source ./c 2>errors##; "
                  "s#autoload#fpath=(./functions $fpath); autoload#' settings")
                .exit_code,
            0);
  EXPECT_THAT(complete("torsio crossv"), ElementsAre("crossvalidate"));
}

TEST_F(Completion, OfFishHasVerbsOptionsValuesAndFiles) {
  if (!has_shell("fish")) GTEST_SKIP() << "fish is not installed";
  (void)folder_.file("log_a.csv", "");
  ASSERT_EQ(torsio("completion fish >c").exit_code, 0);
  const auto complete = [this](const std::string& line) {
    const Outcome outcome =
        shell("HOME=$PWD fish --no-config -c 'source c; complete -C \"" + line + "\"'");
    EXPECT_EQ(outcome.err, "") << line;
    std::vector<std::string> words = lines_of(outcome.out);
    for (std::string& word : words) word.resize(std::min(word.find('\t'), word.size()));
    return words;
  };
  EXPECT_THAT(complete("torsio crossv"), ElementsAre("crossvalidate"));
  EXPECT_THAT(complete("torsio log"), IsEmpty()) << "a verb, not a file";
  EXPECT_THAT(complete("torsio --vers"), ElementsAre("--version"));
  EXPECT_THAT(complete("torsio fit --dev"), ElementsAre("--device-serial"));
  EXPECT_THAT(complete("torsio fit log_a.csv --model gre"), ElementsAre("grey_box"));
  EXPECT_THAT(complete("torsio fit log"), ElementsAre("log_a.csv"));
  EXPECT_THAT(complete("torsio fit log_a.csv log"), ElementsAre("log_a.csv"));
  EXPECT_THAT(complete("torsio simulate dfki-50 static"), ElementsAre("static-cycle"));
  EXPECT_THAT(complete("torsio simulate dfki-28:l"), Contains("dfki-28:lugre"));
  EXPECT_THAT(complete("torsio simulate -o static"), IsEmpty()) << "a file, not an experiment";
  EXPECT_THAT(complete("torsio connect reco"), ElementsAre("record"));
  EXPECT_THAT(complete("torsio connect play --va"), ElementsAre("--valid"));
  EXPECT_THAT(complete("torsio fit --model=gre"), ElementsAre("--model=grey_box"));
}

}  // namespace
}  // namespace torsio::test
