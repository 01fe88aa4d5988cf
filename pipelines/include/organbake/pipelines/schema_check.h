// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "organbake/pipelines/document.h"

namespace organbake {

// The first thing that is wrong with a document by a JSON Schema (draft 7), as one sentence with
// its place: "recipe.yaml:7: decimate.faces is -3; it must be a whole number, at least 4".
// Nothing when the document is valid.
std::optional<std::string> schema_error(const Document& document, const nlohmann::json& schema);

}  // namespace organbake
