// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace organbake {

// A whole bake's options by one word. `standard` is what the stages do by themselves; `draft` and
// `fine` stand where `organbench bake` found nothing that is both faster and more accurate. What a
// recipe or --set says outranks them.
const std::vector<std::string>& quality_names();  // draft, standard, fine

struct QualityOption {
  std::string section, key, value;  // value as a command line gives it
};
// Throws std::out_of_range for another name.
std::vector<QualityOption> quality_options(const std::string& name);

}  // namespace organbake
