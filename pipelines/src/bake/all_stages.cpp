// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/core/text.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

#define STAGE(name) Stage name##_stage();  // in its folder's options.cpp
#include "stages/list.def"
#undef STAGE

std::string input_of_many(const StageInput& input, std::size_t index,
                          const std::filesystem::path& path) {
  constexpr std::size_t kDigits = 4;  // names sort as they were given
  return input.name + " " + padded(index, kDigits) + " " + path.filename().string();
}

const std::vector<Stage>& all_stages() {
  static const std::vector<Stage> stages = {
#define STAGE(name) name##_stage(),
#include "stages/list.def"
#undef STAGE
  };
  return stages;
}

const Stage* find_stage(const std::string& name) {
  for (const Stage& stage : all_stages()) {
    if (stage.name == name) return &stage;
  }
  return nullptr;
}

}  // namespace organbake
