// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/quality.h"

#include <algorithm>
#include <stdexcept>

namespace organbake {
namespace {

struct QualityRow {
  const char *section, *key;
  const char* values[3];  // draft, standard, fine
};

// Only what trades time for error whatever the scene: how many faces a proxy needs is the tissue's
// question, and what a surface's noise needs is the scanner's.
constexpr QualityRow kQualityRows[] = {
    {"decimate", "flips", {"false", "true", "true"}},
    {"place", "count", {"6", "8", "12"}},
    {"place", "size_px", {"256", "512", "1024"}},
    {"place", "size_limit_px", {"512", "2048", "2048"}},
    {"capture", "rays_per_texel_side", {"1", "0", "0"}},
    {"capture", "base_step_mm", {"4", "1.5", "1"}},
};

}  // namespace

const std::vector<std::string>& quality_names() {
  static const std::vector<std::string> names = {"draft", "standard", "fine"};
  return names;
}

std::vector<QualityOption> quality_options(const std::string& name) {
  const auto& names = quality_names();
  const auto column = std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
  if (column == names.size()) throw std::out_of_range("no quality '" + name + "'");
  std::vector<QualityOption> options;
  for (const QualityRow& row : kQualityRows)
    options.push_back({row.section, row.key, row.values[column]});
  return options;
}

}  // namespace organbake
