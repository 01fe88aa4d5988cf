// SPDX-License-Identifier: GPL-3.0-or-later
#include "batch_flags.h"

#include "organbake/core/error.h"
#include "organbake/pipelines/recipe_library.h"

namespace organbake {

namespace fs = std::filesystem;

void add_case_flags(OptionList& list, CaseFlags& flags) {
  list.add("recipe", &flags.recipe,
           {.help = "what to bake every case with: a file, or one of 'organbake recipes' by name",
            .suggestions = known_recipe_names(),
            .value = "RECIPE"})
      .add("output", &flags.output,
           {.help = "folder that gets a folder for each case", .value = "DIR", .short_flag = "-o"})
      .add("as", &flags.input,
           {.help = "the recipe's input that files given by name are", .value = "INPUT"})
      .add("set", &flags.settings,
           {.help = "for all cases, repeatable; a case's own settings go first",
            .value = "KEY=VALUE"})
      .add("pictures", &flags.pictures, {.help = "a picture of every organ, for the page"})
      .add("web", &flags.web,
           {.help = "a page for every organ in which anyone can poke it; the batch's links to it"})
      .add("strict", &flags.strict,
           {.help = "a case whose stages warned of something ends with exit code 3, written"})
      .add("memory", &flags.memory_mb,
           {.help = "what the cases under way may need; 0 = what this machine has",
            .unit = "MB",
            .min = 0,
            .max = 1e9})
      .add("cache", &flags.cache, {.help = "folder of the cache", .value = "DIR"});
}

std::vector<BatchCase> read_cases(const std::vector<std::string>& words, CaseFlags& flags,
                                  const std::string& command) {
  if (words.empty()) {
    throw UsageError("'organbake " + command + "' needs a table of cases, files, or a pattern");
  }
  if (flags.recipe.empty()) throw UsageError("--recipe is missing: how shall the cases be baked?");
  if (flags.output.empty()) throw UsageError("-o is missing: where shall the bundles go?");
  flags.recipe = recipe_file(flags.recipe.string());
  return cases_of_words(words, flags.input);
}

std::vector<CaseEstimate> estimates_of(const std::vector<BatchCase>& cases, const CaseFlags& flags,
                                       const RunContext& context) {
  std::vector<CaseEstimate> estimates;
  for (const BatchCase& one : cases) {
    context.throw_if_cancelled();
    std::vector<std::string> settings = flags.settings;
    settings.insert(settings.end(), one.settings.begin(), one.settings.end());
    estimates.push_back(estimate_case(flags.recipe, settings));
  }
  return estimates;
}

void check_spares_tables(const std::vector<std::string>& words, const fs::path& file) {
  std::error_code ignored;
  for (const std::string& word : words) {
    if (!fs::equivalent(word, file, ignored)) continue;
    throw IoError::writing(file,
                           "is the table of cases, and would be overwritten by one of that "
                           "name; rename it or name another -o");
  }
}

void make_batch_folder(const fs::path& folder) {
  if (fs::exists(folder / "manifest.json"))
    throw IoError::writing(folder, "is a bundle; name another folder for the cases");
  std::error_code error;
  fs::create_directories(folder / "logs", error);
  if (!fs::is_directory(folder / "logs")) {
    throw IoError::writing(folder, error ? error.message() : "is a file; name a folder");
  }
}

}  // namespace organbake
