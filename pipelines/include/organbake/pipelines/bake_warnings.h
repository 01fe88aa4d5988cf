// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace organbake {

// The one list of what gives reason to look at a stage's result before the organ is used: what it
// `said` while it ran, the damage and the gate of its report (schema stage-report), and figures
// beyond what a good bake has. Whole sentences, each once, in a bake's words unless the stage ran
// alone.
std::vector<std::string> stage_warnings(const nlohmann::json& stage_report,
                                        const std::vector<std::string>& said = {},
                                        bool in_bake = true);

// Of all stages of a bundle's report.json (schema bake-report), the stage's name first. What was
// said while they ran is not in there: it may name files of the machine that baked.
std::vector<std::string> bake_warnings(const nlohmann::json& bake_report);

}  // namespace organbake
