// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/forgotten_recipe.h"

#include <string>

#include "bake/given_input.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

std::string quoted(const std::string& word) {
  return word.find_first_of(" '\"()&;$") == std::string::npos ? word : "\"" + word + "\"";
}

}  // namespace

void check_is_no_input(const fs::path& file) {
  const std::string name = file.string();
  if (!fs::exists(file)) return;
  if (fs::exists(file / "manifest.json"))
    throw UsageError(name + " is a bundle, baked already; 'organplay' shows it");
  const std::string ending = lower_ending(file);
  if (ending == ".csv" || ending == ".tsv")
    throw UsageError(name + " is a table of cases, not a recipe; write: organbake batch " +
                     quoted(name) + " --recipe liver -o FOLDER");
  const GivenInput given = given_input(file);
  if (given.input.empty()) return;
  throw UsageError(name + " is " + given.what + ", not a recipe; write: organbake bake " +
                   (given.input == "frames" ? "laparoscopy" : "liver") + " --set " +
                   quoted(given.input + "=" + name) + " -o BUNDLE");
}

}  // namespace organbake
