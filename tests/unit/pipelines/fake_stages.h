// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/runner.h"
#include "support/testing.h"

namespace organbake {

// Stands in for the stages' modules: writes every output that a stage announces, with a text made
// of the stage's options and its inputs' contents, and remembers what was called. So the runner,
// the cache and the bundle can be tested in milliseconds.
class FakeStages {
 public:
  StageReport run(const Stage& stage, const StageCall& call);
  Runner runner(const std::filesystem::path& cache_folder);

  // Names of the stages that ran since the last call, "a b c".
  std::string take_calls();
  // This stage throws, after it has written half of its outputs.
  std::string failing_stage;
  // This stage warns of an oddity.
  std::string warning_stage, oddity = "something is odd";
  // Each stage that reads this input warns of it.
  std::string odd_input;
  // What any stage warned of in runs of its runners, "stage: warning".
  std::vector<std::string> heard;

 private:
  std::vector<std::string> calls_;
};

// Writes `yaml` into the folder and reads it as a recipe.
Recipe recipe_from(const std::filesystem::path& folder, const std::string& yaml,
                   const std::vector<std::string>& settings = {});

}  // namespace organbake
