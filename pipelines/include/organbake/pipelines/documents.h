// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"
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

// The first thing that is wrong with a document by a JSON Schema (draft 7), as one sentence with
// its place: "recipe.yaml:7: decimate.faces is -3; it must be a whole number, at least 4".
// Nothing when the document is valid.
std::optional<std::string> schema_error(const Document& document, const nlohmann::json& schema);

// The frame of every page that is written: one file, nothing fetched, readable without styles.
// `title` is plain text; `style` is what this page's style sheet adds to the common one; `body` is
// HTML.
std::string html_page(const std::string& title, const std::string& style, const std::string& body);

// A table cell of plain text.
std::string html_cell(const std::string& text);

// A file's path as part of a link, and a link to it; `text` is plain.
std::string url_of(const std::string& path);
std::string html_link(const std::string& path, const std::string& text);

// A picture as part of the page: <img> with the alternative text, which must not be empty.
std::string html_picture(const Rgb8Image& image, const std::string& alternative);
// "data:image/png;base64,…", where SVG wants a link.
std::string png_data_uri(const Rgb8Image& image);

// With so many significant digits at most, for tables and charts: 0.012346 → "0.01235", and
// 12345678 → "12345678".
std::string page_number(double value, int digits = 4);

}  // namespace organbake
