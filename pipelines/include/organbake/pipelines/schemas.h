// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/pipelines/document.h"

namespace organbake {

// The JSON Schemas of all documents that the project reads or writes, as data-schemas/ holds them:
// "cameras", "interaction", "recipe" … in byte order.
std::vector<std::string> schema_names();
// Exactly the text of data-schemas/NAME.schema.json. Throws UsageError for an unknown name.
std::string schema_text(const std::string& name);

// The schema that a document asks for by its "schema" key ("organbake/cameras/1" → "cameras").
// Throws BadDataError when it names none of ours.
std::string schema_of(const Document& document);
// Throws BadDataError that names file, line and key.
void check_document(const Document& document, const std::string& schema_name);
void check_json_file(const std::filesystem::path& file, const std::string& schema_name);

}  // namespace organbake
