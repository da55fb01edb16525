#include "apps/cli/commands.hpp"

namespace flexor::cli::completion_command {

// Each asks the program for what may stand at the cursor, with the words of the line up to there: it knows no command itself.
const std::map<std::string, const char*> kScripts = {
    {"words", ""},
    {"bash",
     R"(_flexor() { mapfile -t COMPREPLY < <("$1" completion words "${COMP_WORDS[@]:0:COMP_CWORD+1}" 2>/dev/null); }
complete -o default -F _flexor flexor
)"},
    {"fish",
     R"(complete -c flexor -a '(flexor completion words (commandline -opc) (commandline -ct) 2>/dev/null)'
)"},
    {"powershell", R"(Register-ArgumentCompleter -Native -CommandName flexor -ScriptBlock {
  param($word, $line, $position)
  $words = @($line.CommandElements | ForEach-Object { "$_" })
  if (-not $word) { $words += '""' }
  flexor completion words @words 2>$null | ForEach-Object { [System.Management.Automation.CompletionResult]::new($_) }
}
)"},
    {"zsh", R"(#compdef flexor
_flexor() {
  local -a found=("${(@f)$(${~words[1]} completion words "${(@)words[1,CURRENT]}" 2>/dev/null)}")
  if [[ -n $found ]]; then compadd -a found; else _files; fi
}
if [[ $funcstack[1] = _flexor ]]; then _flexor "$@"; else compdef _flexor flexor; fi
)"},
};

struct Options {
  std::string shell;
  CLI::App* app = nullptr;
  CLI::App* command = nullptr;
};

// The values of a choice, as its help shows them.
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{') + 1;
  return begin == 0 ? std::vector<std::string>()
                    : CLI::detail::split(type.substr(begin, type.find('}') - begin), ',');
}

// What may stand for the last word of the line, which begins with the program; nothing: a file, or anything.
std::vector<std::string> candidates(const CLI::App& app, const std::vector<std::string>& line) {
  const CLI::App* command = &app;
  const CLI::Option* option = nullptr;  // whose value the next word is
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    if (line[i] == "=") continue;  // bash cuts --option=value there
    option = command->get_option_no_throw(line[i]);
    for (const CLI::App* one : command->get_subcommands({}))
      if (one->check_name(line[i])) command = one;
  }
  if (option != nullptr && option->get_items_expected_max() > 0) return choices_of(*option);
  std::vector<std::string> out;
  for (const CLI::App* one : command->get_subcommands({})) out.push_back(one->get_name());
  for (const CLI::Option* one : command->get_options()) {
    if (one->get_positional()) {
      const std::vector<std::string> choices = choices_of(*one);
      out.insert(out.end(), choices.begin(), choices.end());
    } else if (line.back().starts_with('-')) {
      out.push_back("--" + one->get_lnames().front());
    }
  }
  return out;
}

void run(const Options& o) {
  if (o.shell != "words") return print(kScripts.at(o.shell));
  std::vector<std::string> line = o.command->remaining();
  if (line.size() < 2) line.resize(2);
  std::string head;
  if (line.back() == "=" || line.back() == "\"\"") line.back().clear();  // bash's; PowerShell's for no word
  if (const std::size_t equals = line.back().find('=');
      line.back().starts_with("--") && equals != line.back().npos) {
    head = line.back().substr(0, equals + 1);
    line.insert(line.end() - 1, head.substr(0, equals));
    line.back().erase(0, equals + 1);
  }
  for (const std::string& word : candidates(*o.app, line))
    if (word.starts_with(line.back())) print(head + word + "\n");
}

void add(CLI::App& app) {
  const auto [o, command] =
      add_command(app, "completion", "Completion of commands, options and choices for a shell", run);
  o->app = &app;
  o->command = command;
  command
      ->add_option("shell", o->shell,
                   "whose script is printed; words: what the script asks, behind it the line")
      ->check(CLI::IsMember(kScripts))
      ->required();
  command->prefix_command();
}

}  // namespace flexor::cli::completion_command
