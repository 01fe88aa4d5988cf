// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "bench.h"

namespace organbake {

// A suite's part of organbench.json (schema "bench").
nlohmann::ordered_json to_json(const SuiteResult& result);
// Of valid JSON; throws nlohmann::json::exception for any other.
SuiteResult suite_result_from_json(const nlohmann::ordered_json& json);

}  // namespace organbake
