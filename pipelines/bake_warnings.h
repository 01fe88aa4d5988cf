// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace organbake {

// What a bake's report.json (schema bake-report) gives reason to look at before the organ is used:
// what its stages said of themselves, and figures beyond what a good bake has. Sentences, the
// stage's name first.
std::vector<std::string> bake_warnings(const nlohmann::json& bake_report);

}  // namespace organbake
