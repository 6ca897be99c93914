#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "manual.hpp"
#include "schemas.hpp"
#include "trihedron/io/config.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/records/drift_models.hpp"

namespace trihedron::cli {
namespace {

void add_schema(CLI::App& program, int& exit_status) {
  auto name = std::make_shared<std::string>();
  std::string words;
  for (const io::Schema& schema : all_schemas()) {
    words += (words.empty() ? "" : "|") + schema.name;
  }
  CLI::App* command = program.add_subcommand("schema", "Print the JSON schema of a file or of an output of --json");
  command->add_option("NAME", *name, "Of which; without it the names are listed")->type_name(words);
  command->footer(
      "# What a scenario may hold\n"
      "trihedron schema scenario\n"
      "# Check the output of a command\n"
      "trihedron --json inspect pass.nc > pass.json && trihedron schema inspect-output > schema.json\n"
      "python3 -m jsonschema -i pass.json schema.json");
  command->callback([&exit_status, name] {
    std::vector<std::string> names;
    std::vector<std::string_view> known;
    for (const io::Schema& schema : all_schemas()) {
      if (schema.name == *name) {
        print_data(stdout, schema.text() + "\n");
        exit_status = kTrustworthy;
        return;
      }
      names.push_back(schema.name);
    }
    if (!name->empty()) {
      throw io::UsageError(fmt::format("there is no schema {}; there are {}", *name, fmt::join(names, ", ")));
    }
    print_data(stdout, fmt::format("{}\n", fmt::join(names, "\n")));
    exit_status = kTrustworthy;
  });
}

void add_man(CLI::App& program, int& exit_status) {
  auto name = std::make_shared<std::string>();
  auto as_markdown = std::make_shared<bool>(false);
  CLI::App* man = program.add_subcommand("man", "Print a manual page");
  // Words for the completion; those of the two commands that are not yet added as well.
  std::string words;
  for (const CLI::App* command : commands_of(program)) {
    words += command->get_name() + "|";
  }
  man->add_option("COMMAND", *name, "Of which; without it the page of all")->type_name(words + "completion");
  man->add_flag("--markdown", *as_markdown, "All as Markdown, docs/commands.md");
  man->footer(
      "trihedron man > trihedron.1 && man ./trihedron.1\ntrihedron man calibrate > calibrate.1 && man ./calibrate.1");
  man->callback([&program, &exit_status, name, as_markdown] {
    const std::vector<const CLI::App*> commands = commands_of(program);
    const auto command = std::ranges::find(commands, *name, [](const CLI::App* its) { return its->get_name(); });
    if (!name->empty() && (command == commands.end() || *as_markdown)) {
      throw io::UsageError(*as_markdown ? "--markdown is of all commands; leave out COMMAND"
                                        : fmt::format("there is no command {}; see trihedron --help", *name));
    }
    print_data(stdout, *as_markdown    ? markdown(program)
                       : name->empty() ? man_page(program)
                                       : man_page(program, **command));
    exit_status = kTrustworthy;
  });
}

}  // namespace

void add_references(CLI::App& program, int& exit_status) {
  add_schema(program, exit_status);
  add_man(program, exit_status);

  auto shell = std::make_shared<std::string>();
  CLI::App* completions = program.add_subcommand("completion", "Print a script that completes commands and options");
  completions->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->type_name(std::string(kShells))
      ->check([](const std::string& given) {
        return std::ranges::count(CLI::detail::split(std::string(kShells), '|'), given) > 0
                   ? std::string()
                   : "not one of bash, zsh, fish";
      });
  completions->footer("source <(trihedron completion bash)");
  completions->callback([&program, &exit_status, shell] {
    print_data(stdout, completion(program, *shell));
    exit_status = kTrustworthy;
  });
}

void add_need(CLI::App& command, std::string& need) {
  command
      .add_option("--need", need,
                  "Accuracy that is needed without the star tracker, like \"5arcmin for 270min\": where it is not "
                  "predicted with 99.7 %, the verdict is do not use")
      ->type_name("\"ANGLE for DURATION\"");
}

void add_config(CLI::App& command, std::string& file, const std::function<CalibrationOptions()>& settle) {
  command.add_option("--config", file, "Settings (TOML); - for standard input")->type_name("FILE");
  // The last option of the command: when it is dealt with, those before it have their values.
  command.add_flag_callback(
      "--print-config",
      [settle] {
        print_data(stdout, io::format_config(settle()));
        throw CLI::Success();
      },
      "Print the settings in effect, which --config takes, and do nothing else");
}

CalibrationOptions settings_of(const std::string& file) {
  return file.empty() ? CalibrationOptions{} : io::read_config(source(file));
}

CLI::Validator whole(const Range& range) {
  const auto least = static_cast<int>(range.least);
  const auto most = static_cast<int>(range.most);
  return {[least, most](const std::string& text) {
            int value = 0;
            return CLI::detail::lexical_cast(text, value) && value >= least && value <= most
                       ? std::string()
                       : fmt::format("{} is not a whole number from {} to {}", text, least, most);
          },
          ""};
}

}  // namespace trihedron::cli
