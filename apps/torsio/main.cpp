#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>

#include "common/interrupt.hpp"
#include "common/output.hpp"
#include "common/report_output.hpp"
#include "common/wrong_call.hpp"
#include "completion.hpp"
#include "man_pages.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "verbs.hpp"

namespace {

constexpr int kWorkFailed = 1;
constexpr int kCallWasWrong = 2;

int complain(const char* message, int exit_code) {
  std::fprintf(stderr, "torsio: %s\n", message);
  return exit_code;
}

/// An empty value, from a variable of the shell that is not set, must not act as no option.
void refuse_empty_values(CLI::App& app) {
  const auto refuse = [](const std::string& text) {
    return text.empty() ? std::string("expected a value, found an empty text") : std::string();
  };
  for (CLI::App* verb : app.get_subcommands({}))
    for (CLI::Option* option : verb->get_options())
      if (option->get_items_expected_max() > 0) option->check(refuse);
  for (CLI::App* verb : app.get_subcommands({})) refuse_empty_values(*verb);
}

/// Printed to a person who types the name alone.
constexpr const char* kFirstSteps =
    "torsio fits models of a series-elastic actuator's spring and estimates the joint torque.\n\n"
    "  torsio demo                              the whole workflow on a simulated bench, with a "
    "report\n"
    "  torsio check my_recording.csv            can a model be trained on it?\n"
    "  torsio compare a.csv b.csv --test c.csv --report result.html\n"
    "                                           which model is best, with pictures\n"
    "  torsio fit a.csv b.csv --model grey_box -o joint.safetensors\n"
    "  torsio doctor                            what this machine has for torsio\n\n"
    "torsio --help lists all verbs, torsio VERB --help their options.\n";

void add_completion(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("completion",
                                      "print a script that completes verbs and options in a shell");
  verb->footer(
      "Example: source <(torsio completion bash)      in ~/.bashrc, or zsh in ~/.zshrc\n"
      "         torsio completion fish > ~/.config/fish/completions/torsio.fish");
  auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "bash, zsh or fish")->required();
  verb->callback([&app, shell] { print(completion_script(app, *shell)); });
}

int run(int argc, char** argv) {
  if (argc == 1) {
    print(kFirstSteps);
    return kCallWasWrong;  // a script may have empty variables
  }
  CLI::App app(
      "Fits models of a series-elastic actuator's spring and estimates the joint torque with them.",
      "torsio");
  app.set_version_flag("--version", torsio::kVersion);
  app.require_subcommand(1);
  add_demo(app);
  add_simulate(app);
  add_arm(app);
  add_joint(app);
  add_map(app);
  add_check(app);
  add_fit(app);
  add_identify(app);
  add_evaluate(app);
  add_drift(app);
  add_estimate(app);
  add_compare(app);
  add_crossvalidate(app);
  add_search(app);
  add_fleet(app);
  add_work(app);
  add_store(app);
  add_attribute(app);
  add_adapt(app);
  add_import(app);
  add_export(app);
  add_monitor(app);
  add_transfer(app);
  add_track(app);
  add_tune_loop(app);
  add_design(app);
  add_connect(app);
  add_reproduce(app);
  add_unpack(app);
  add_convert(app);
  add_bench(app);
  add_doctor(app);
  add_completion(app);
  // For the build, which installs the pages: in no help text.
  app.add_option_function<std::string>("--man-pages",
                                       [&app](const std::string& folder) {
                                         write_man_pages(app, folder);
                                         throw CLI::Success();
                                       })
      ->group("")
      ->trigger_on_parse();
  refuse_empty_values(app);
  catch_interrupts();
  keep_command_line(argc, argv);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0)
      if (const std::string unknown = unknown_name(app, argc, argv); !unknown.empty())
        return complain(unknown.c_str(), kCallWasWrong);
    return app.exit(error) == 0 ? 0 : kCallWasWrong;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const torsio::UsageError& error) {
    return complain(error.what(), kCallWasWrong);
  } catch (const torsio::Error& error) {
    lift_interrupt_deadline();
    (void)complain(error.what(), kWorkFailed);
    if (is_interrupted()) end_as_interrupted();
    return kWorkFailed;
  } catch (const std::bad_alloc&) {
    return complain("out of memory: use fewer or shorter recordings", kWorkFailed);
  } catch (const std::exception& error) {
    return complain(error.what(), kWorkFailed);
  }
}
