#include "manual.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "terminal.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::cli {
namespace {

constexpr std::size_t kColumns = 100;
constexpr std::size_t kIndent = 30;  // of what an option means

constexpr std::array<std::pair<int, std::string_view>, 5> kExitStatuses = {
    {{0, "done, and the result can be trusted"},
     {1, "done, but the verdict is \"do not use\"; what to do is said with it"},
     {2, "wrong usage"},
     {3, "an input was refused, with its place, the reason and the cure"},
     {4, "the machine failed: disk, memory"}}};

/// Lines of at most kColumns; the first begins at column `at`, the others at `indent`.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t at) {
  std::string out;
  std::size_t column = at;
  bool begins = true;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (!begins && column + 1 + width(word) > kColumns) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!begins) {
      out += ' ';
      ++column;
    }
    out += word;
    column += width(word);
    begins = false;
  }
  return out;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app, bool positional) {
  std::vector<const CLI::Option*> options = app.get_options([&](const CLI::Option* option) {
    return option->get_positional() == positional && !option->get_group().empty();
  });
  for (const CLI::App* group : app.get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); })) {
    std::ranges::copy_if(options_of(*group, positional), std::back_inserter(options),
                         [](const CLI::Option* option) { return option->get_name() != "--help"; });
  }
  return options;
}

/// "-o, --output FILE"; of a positional "PASS" or "PASS...".
std::string term_of(const CLI::Option& option) {
  if (option.get_positional()) {
    return option.get_name(true) + (option.get_expected_max() > 1 ? "..." : "");
  }
  std::string term;
  for (const std::string& name : option.get_snames()) {
    term += (term.empty() ? "-" : ", -") + name;
  }
  for (const std::string& name : option.get_lnames()) {
    term += (term.empty() ? "--" : ", --") + name;
  }
  return option.get_items_expected_max() > 0 ? term + " " + option.get_type_name() : term;
}

std::string meaning_of(const CLI::Option& option) {
  std::string meaning = option.get_description();
  if (option.get_required() && !option.get_positional()) {
    meaning += " (required)";
  }
  return option.get_default_str().empty() ? meaning
                                          : fmt::format("{} [default: {}]", meaning, option.get_default_str());
}

/// "trihedron navigate PASS -o FILE [options]"
std::string synopsis_of(const CLI::App& command, const std::string& name) {
  std::string text = name;
  for (const CLI::Option* option : options_of(command, true)) {
    text += option->get_required() ? " " + term_of(*option) : fmt::format(" [{}]", term_of(*option));
  }
  for (const CLI::Option* option : options_of(command, false)) {
    if (option->get_required()) {
      text += fmt::format(" {} {}", option->get_name(), option->get_type_name());
    }
  }
  return text + (options_of(command, false).empty() ? "" : " [options]");
}

std::string entry(std::string_view term, std::string_view meaning) {
  std::string text = fmt::format("  {}", term);
  const std::size_t end = 2 + width(term);
  if (end + 2 > kIndent) {
    text += "\n" + std::string(kIndent, ' ');
  } else {
    text += std::string(kIndent - end, ' ');
  }
  return text + wrapped(meaning, kIndent, kIndent) + "\n";
}

std::string entries(const std::string& title, const std::vector<const CLI::Option*>& options) {
  std::string text = options.empty() ? "" : "\n" + title + "\n";
  for (const CLI::Option* option : options) {
    text += entry(term_of(*option), meaning_of(*option));
  }
  return text;
}

/// roff: what would be read as a request or an escape.
std::string roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool begins = out.empty() || out.back() == '\n';
    out += c == '\\'                           ? "\\e"
           : c == '-'                          ? "\\-"
           : begins && (c == '.' || c == '\'') ? fmt::format("\\&{}", c)
                                               : std::string(1, c);
  }
  return out;
}

void man_options(std::string& page, const std::vector<const CLI::Option*>& options) {
  for (const CLI::Option* option : options) {
    page += fmt::format(".TP\n.B {}\n{}\n", roff(term_of(*option)), roff(meaning_of(*option)));
  }
}

std::string man_head(std::string_view name, std::string_view about) {
  std::string title(name);
  std::ranges::transform(title, title.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format(".TH {} 1 \"\" \"trihedron {}\" \"User Commands\"\n.ad l\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n",
                     roff(title), roff(TRIHEDRON_VERSION), roff(name), roff(about));
}

/// As they are.
std::string man_lines(std::string_view lines) {
  return lines.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", roff(lines));
}

std::string man_tail() {
  std::string text = ".SH EXIT STATUS\n";
  for (const auto& [status, meaning] : kExitStatuses) {
    text += fmt::format(".TP\n.B {}\n{}\n", status, roff(meaning));
  }
  return text +
         ".SH ENVIRONMENT\n.TP\n.B NO_COLOR\nWhere it is set, nothing is coloured; nothing is anyway where the output "
         "is no "
         "terminal.\n";
}

void markdown_options(std::string& page, const std::vector<const CLI::Option*>& options) {
  for (const CLI::Option* option : options) {
    page += "- " + wrapped(fmt::format("`{}`: {}", term_of(*option), meaning_of(*option)), 2, 2) + "\n";
  }
  page += options.empty() ? "" : "\n";
}

/// The words of a type such as "DURATION|none|continuous": those in lower case.
std::vector<std::string> words_of(const CLI::Option& option) {
  std::vector<std::string> words;
  for (const std::string& word : CLI::detail::split(option.get_type_name(), '|')) {
    if (!word.empty() && word.front() >= 'a' && word.front() <= 'z') {
      words.push_back(word);
    }
  }
  return words;
}

std::vector<const CLI::Option*> options_with_global(const CLI::App& program, const CLI::App& command) {
  std::vector<const CLI::Option*> options = options_of(command, false);
  for (const CLI::Option* option : options_of(program, false)) {
    if (option->get_name() != "--help") {
      options.push_back(option);
    }
  }
  return options;
}

std::string names_of(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : option.get_lnames()) {
    names += (names.empty() ? "--" : " --") + name;
  }
  for (const std::string& name : option.get_snames()) {
    names += " -" + name;
  }
  return names;
}

std::string completion_for_bash(const CLI::App& program) {
  std::string commands;
  std::string cases;
  for (const CLI::App* command : commands_of(program)) {
    commands += (commands.empty() ? "" : " ") + command->get_name();
    std::string options;
    std::string values;
    for (const CLI::Option* option : options_with_global(program, *command)) {
      options += (options.empty() ? "" : " ") + names_of(*option);
      if (const auto words = words_of(*option); !words.empty()) {
        values += fmt::format("        {}) words=\"{}\" ;;\n",
                              fmt::join(CLI::detail::split(names_of(*option), ' '), "|"), fmt::join(words, " "));
      }
    }
    for (const CLI::Option* argument : options_of(*command, true)) {
      for (const std::string& word : words_of(*argument)) {
        options += " " + word;
      }
    }
    cases += fmt::format("    {})\n      options=\"{}\"\n      case $before in\n{}        *) ;;\n      esac ;;\n",
                         command->get_name(), options, values);
  }
  return fmt::format(
      R"(# bash completion of trihedron: source it, or put it where bash-completion finds it.
_trihedron() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} command="" words="" options="" i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case ${{COMP_WORDS[i]}} in -*) ;; *) command=${{COMP_WORDS[i]}}; break ;; esac
  done
  case $command in
    "") words="{}" ;;
{}    *) ;;
  esac
  if [[ -z $words && ( $word == -* || $command == schema || $command == man || $command == completion ) ]]; then words=$options; fi
  # Words of options, such as vsh:2, hold a colon, which bash takes for the end of a word: only what follows it is completed.
  COMPREPLY=($(compgen -W "$words" -- "$word"))
  if [[ -z $words ]]; then compopt -o default; fi
}}
complete -F _trihedron trihedron
)",
      commands, cases);
}

/// For a text in single quotes.
std::string quoted(std::string_view text, std::string_view escaped) {
  std::string out;
  for (const char c : text) {
    out += c == '\'' ? std::string(escaped) : std::string(1, c);
  }
  return out;
}

std::string completion_for_fish(const CLI::App& program) {
  std::string script = "# fish completion of trihedron: put it into ~/.config/fish/completions/trihedron.fish\n";
  const auto about = [](std::string_view text) { return quoted(text, "\\'"); };
  for (const CLI::App* command : commands_of(program)) {
    script += fmt::format("complete -c trihedron -n __fish_use_subcommand -f -a {} -d '{}'\n", command->get_name(),
                          about(command->get_description()));
    for (const CLI::Option* option : options_with_global(program, *command)) {
      script += fmt::format("complete -c trihedron -n '__fish_seen_subcommand_from {}'", command->get_name());
      for (const std::string& name : option->get_snames()) {
        script += " -s " + name;
      }
      for (const std::string& name : option->get_lnames()) {
        script += " -l " + name;
      }
      const auto words = words_of(*option);
      script += words.empty() ? (option->get_items_expected_max() > 0 ? " -r" : "")
                              : fmt::format(" -x -a '{}'", fmt::join(words, " "));
      script += fmt::format(" -d '{}'\n", about(option->get_description()));
    }
    for (const CLI::Option* argument : options_of(*command, true)) {
      if (const auto words = words_of(*argument); !words.empty()) {
        script += fmt::format("complete -c trihedron -n '__fish_seen_subcommand_from {}' -f -a '{}'\n",
                              command->get_name(), fmt::join(words, " "));
      }
    }
  }
  return script;
}

std::string completion_for_zsh(const CLI::App& program) {
  std::string commands;
  std::string cases;
  // In a specification of _arguments brackets and colons have a meaning.
  const auto about = [](std::string_view text) {
    std::string out;
    for (const char c : quoted(text, "'\\''")) {
      out += c == '[' || c == ']' || c == ':' ? fmt::format("\\{}", c) : std::string(1, c);
    }
    return out;
  };
  for (const CLI::App* command : commands_of(program)) {
    commands += fmt::format("    '{}:{}'\n", command->get_name(), quoted(command->get_description(), "'\\''"));
    std::string specifications;
    for (const CLI::Option* option : options_with_global(program, *command)) {
      const auto words = words_of(*option);
      for (const std::string& name : CLI::detail::split(names_of(*option), ' ')) {
        std::string value;
        if (option->get_items_expected_max() > 0) {
          std::string list;
          for (const std::string& word : words) {
            list += (list.empty() ? "" : " ") + about(word);
          }
          value = words.empty() ? ":value:_files" : fmt::format(":value:({})", list);
        }
        specifications += fmt::format(" '{}[{}]{}'", name, about(option->get_description()), value);
      }
    }
    std::string rest = "'*:file:_files'";
    for (const CLI::Option* argument : options_of(*command, true)) {
      if (const auto words = words_of(*argument); !words.empty()) {
        rest = fmt::format("'1:value:({})'", fmt::join(words, " "));
      }
    }
    cases += fmt::format("    {}) _arguments{} {} ;;\n", command->get_name(), specifications, rest);
  }
  return fmt::format(R"(#compdef trihedron
# zsh completion of trihedron: put it into a directory of $fpath under the name _trihedron.
_trihedron() {{
  local -a commands=(
{}  )
  local command
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  command=$words[2]
  shift words
  (( CURRENT-- ))
  case $command in
{}  esac
}}
compdef _trihedron trihedron
)",
                     commands, cases);
}

}  // namespace

std::string HelpFormatter::make_help(const CLI::App* command, std::string name, CLI::AppFormatMode /*mode*/) const {
  const CLI::App* const program = command->get_parent() == nullptr ? command : command->get_parent();
  const std::string called = name.empty() ? command->get_name() : name;
  std::string text;
  if (command == program) {
    text = fmt::format("usage: {} COMMAND [options]\n\n{}\n\nCommands\n", called,
                       wrapped(command->get_description(), 0, 0));
    for (const CLI::App* one : commands_of(*program)) {
      text += entry(one->get_name(), one->get_description());
    }
    text += entries("Options", options_of(*program, false));
    text += fmt::format("\n{} COMMAND --help says more of each.\n", called);
  } else {
    text = fmt::format("usage: {}\n\n{}\n", wrapped(synopsis_of(*command, called), 9, 7),
                       wrapped(command->get_description(), 0, 0));
    text += entries("Arguments", options_of(*command, true));
    text += entries("Options", options_of(*command, false));
    std::vector<const CLI::Option*> global = options_of(*program, false);
    std::erase_if(global, [](const CLI::Option* option) { return option->get_name() == "--help"; });
    text += entries("Options of every command", global);
  }
  text += "\nExit status\n";
  for (const auto& [status, meaning] : kExitStatuses) {
    text += fmt::format("  {}  {}\n", status, meaning);
  }
  if (!command->get_footer().empty()) {
    text += "\nExamples\n";
    for (const std::string& line : CLI::detail::split(command->get_footer(), '\n')) {
      text += fmt::format("  {}\n", line);
    }
  }
  return text;
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App* sub) { return !sub->get_name().empty(); });
}

std::string man_page(const CLI::App& program) {
  std::string page = man_head("trihedron", program.get_description());
  page += ".B trihedron\n.I COMMAND\n[options]\n.SH OPTIONS OF EVERY COMMAND\n";
  man_options(page, options_of(program, false));
  page += ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(program)) {
    page += fmt::format(".SS {}\n{}\n", roff(command->get_name()), roff(command->get_description()));
    page += man_lines(synopsis_of(*command, "trihedron " + command->get_name()));
    man_options(page, options_of(*command, true));
    man_options(page, options_of(*command, false));
    page += man_lines(command->get_footer());
  }
  page += man_tail();
  std::string others;
  for (const CLI::App* command : commands_of(program)) {
    others += fmt::format("{}.BR {} (1)", others.empty() ? "" : ",\n", roff("trihedron-" + command->get_name()));
  }
  return page + ".SH SEE ALSO\n" + others + "\n";
}

std::string man_page(const CLI::App& program, const CLI::App& command) {
  const std::string& name = command.get_name();
  std::string page = man_head("trihedron-" + name, command.get_description());
  page += fmt::format(".B {}\n.SH OPTIONS\n", roff(synopsis_of(command, "trihedron " + name)));
  man_options(page, options_of(command, true));
  man_options(page, options_of(command, false));
  page += ".SH OPTIONS OF EVERY COMMAND\n";
  man_options(page, options_of(program, false));
  page += command.get_footer().empty() ? "" : ".SH EXAMPLES\n" + man_lines(command.get_footer());
  return page + man_tail() + ".SH SEE ALSO\n.BR trihedron (1)\n";
}

std::string markdown(const CLI::App& program) {
  std::string page =
      "# Commands\n\nMade by `trihedron man --markdown` from what the program knows of its options; `trihedron COMMAND "
      "--help` says the\nsame.\n\n## Options of every command\n\n";
  markdown_options(page, options_of(program, false));
  page += "## Exit status\n\n";
  for (const auto& [status, meaning] : kExitStatuses) {
    page += fmt::format("- {}: {}\n", status, meaning);
  }
  page += "\nWhere the output is no terminal, or `NO_COLOR` is set, nothing is coloured.\n";
  for (const CLI::App* command : commands_of(program)) {
    page += fmt::format("\n## {}\n\n{}\n\n    {}\n\n", command->get_name(), command->get_description(),
                        synopsis_of(*command, "trihedron " + command->get_name()));
    markdown_options(page, options_of(*command, true));
    markdown_options(page, options_of(*command, false));
    page += "```sh\n";
    for (const std::string& line : CLI::detail::split(command->get_footer(), '\n')) {
      page += line.empty() ? "" : line + "\n";
    }
    page += "```\n";
  }
  return page;
}

std::string completion(const CLI::App& program, std::string_view shell) {
  return shell == "bash"  ? completion_for_bash(program)
         : shell == "zsh" ? completion_for_zsh(program)
                          : completion_for_fish(program);
}

std::string meant(const CLI::App& program, std::span<const char* const> arguments) {
  std::vector<std::string> commands;
  for (const CLI::App* command : commands_of(program)) {
    commands.push_back(command->get_name());
  }
  const CLI::App* command = nullptr;
  const auto suggested = [](std::string_view word, const std::vector<std::string>& known) {
    if (word == "plan" || word == "advise") {
      return fmt::format("there is no {}: observe SCENARIO.toml --advise looks for slews", word);
    }
    const std::vector<std::string_view> names(known.begin(), known.end());
    const std::string_view name = nearest(word, names);
    return name.empty() ? fmt::format("there is no {}", printable(word))
                        : fmt::format("there is no {}: did you mean {}?", printable(word), name);
  };
  bool is_value = false;
  for (const char* const argument : arguments.subspan(std::min<std::size_t>(1, arguments.size()))) {
    const std::string_view word = argument;
    if (std::exchange(is_value, false)) {
      continue;
    }
    if (word.starts_with("--") && word.size() > 2) {
      std::vector<std::string> known;
      const std::string name(word.substr(0, word.find('=')));
      for (const CLI::Option* option :
           command == nullptr ? options_of(program, false) : options_with_global(program, *command)) {
        for (const std::string& long_name : option->get_lnames()) {
          known.push_back("--" + long_name);
          is_value = is_value || (name == known.back() && name == word && option->get_items_expected_max() > 0);
        }
      }
      if (std::ranges::find(known, name) == known.end()) {
        return suggested(name, known);
      }
    } else if (!word.starts_with('-') && command == nullptr) {
      const auto found = std::ranges::find(commands, word);
      if (found == commands.end()) {
        return suggested(word, commands);
      }
      command = program.get_subcommand(std::string(word));
    }
  }
  return {};
}

}  // namespace trihedron::cli
