// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/image/channel_image.h"

namespace organbake {

// The frame of every page that is written: one file, nothing fetched, readable without styles.
// `title` is plain text; `style` is what this page's style sheet adds to the common one; `body` is
// HTML.
std::string html_page(const std::string& title, const std::string& style, const std::string& body);

// A table cell, or one heading it, of plain text.
std::string html_cell(const std::string& text);
std::string html_heading(const std::string& text);

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
