// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "organbake/options/options.h"

namespace organbake {

nlohmann::json to_json(const OptionValue& value);
// The present values of every option, keys sorted: the canonical form that cache keys and bundles
// hold.
nlohmann::json to_json(const OptionList& options);
// Sets the options that `object` holds. Throws UsageError naming where + key for an unknown key, a
// value of another kind or one out of range.
void set_from_json(const OptionList& options, const nlohmann::json& object,
                   const std::string& where);

// JSON Schema (draft 7) of an object with these options; additional keys are refused.
nlohmann::json options_schema(const OptionList& options);

}  // namespace organbake
