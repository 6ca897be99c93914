#pragma once
/// The commands as they are told: help, manual page, web page and completion, all from the options that the parser
/// knows. The footer of a command holds its examples, lines of a shell.

#include <CLI/CLI.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trihedron::cli {

/// Help of at most 100 columns.
class HelpFormatter : public CLI::FormatterBase {
 public:
  [[nodiscard]] std::string make_help(const CLI::App* command, std::string name,
                                      CLI::AppFormatMode mode) const override;
};

/// trihedron.1, for man.
[[nodiscard]] std::string man_page(const CLI::App& program);
/// trihedron-COMMAND.1, of one of its commands.
[[nodiscard]] std::string man_page(const CLI::App& program, const CLI::App& command);
/// In the order of the help.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& program);

/// docs/commands.md.
[[nodiscard]] std::string markdown(const CLI::App& program);

inline constexpr std::string_view kShells = "bash|zsh|fish";

/// A script that completes commands, options, their words and names of files. `shell`: one of kShells.
[[nodiscard]] std::string completion(const CLI::App& program, std::string_view shell);

/// The command or option that was probably meant by the first word that there is not, "did you mean --estimator?";
/// empty when there is no such word. `arguments` are those of main().
[[nodiscard]] std::string meant(const CLI::App& program, std::span<const char* const> arguments);

}  // namespace trihedron::cli
