// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/recipe_library.h"

namespace organbake {
namespace {

void list_recipes(Session& session) {
  std::string text;
  nlohmann::json json = nlohmann::json::array();
  for (const KnownRecipe& recipe : known_recipes()) {
    constexpr std::size_t kColumn = 16;
    text += recipe.name + std::string(kColumn - std::min(kColumn - 1, recipe.name.size()), ' ') +
            recipe.summary + "\n";
    json.push_back(
        {{"name", recipe.name}, {"summary", recipe.summary}, {"file", recipe.file.string()}});
  }
  session.print_result(text + "\nOne as it is written: organbake recipes liver > mine.yaml\n" +
                           "Baked: organbake bake liver --set ct=CT -o BUNDLE",
                       json);
}

}  // namespace

int run_recipes(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(arguments, "recipes [RECIPE]",
                                          "Lists the recipes that come with organbake, which bake, "
                                          "batch and plan take by name from any "
                                          "folder, or prints one of them, to be changed.",
                                          {}, 1);
  if (!words) return 0;
  if (words->empty()) {
    list_recipes(session);
  } else {
    write_to_stdout(read_text_file(recipe_file(words->front())));
  }
  return 0;
}

}  // namespace organbake
