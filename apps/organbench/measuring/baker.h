// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"

namespace organbake {

// From the phantom organ to a bundle; `more` are the lines that a suite adds.
std::string organ_recipe(const std::string& name, const std::string& more);

// Bakes a recipe as users do, by the organbake that lies beside this program, with a cache in
// `folder`.
class Baker {
 public:
  // Throws NoInputError when there is no organbake.
  Baker(std::filesystem::path folder, RunContext context, const std::string& recipe);

  // `arguments`: --set, --force and the like. organbake's JSON about the run. Throws Error with
  // organbake's own words when it fails.
  nlohmann::ordered_json bake(const std::filesystem::path& bundle,
                              std::vector<std::string> arguments = {}) const;

 private:
  std::filesystem::path folder_;
  RunContext context_;
};

}  // namespace organbake
