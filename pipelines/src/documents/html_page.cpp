// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/html_page.h"

#include <cctype>
#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

#include "organbake/core/base64.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"

namespace organbake {
namespace {

constexpr const char* kCommonStyle =
    "body{font:15px/1.45 system-ui,sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;"
    "color:#222}h1{font-size:1.5rem}h2{font-size:1.2rem;margin-top:2.2rem;"
    "border-bottom:1px solid #ccc}table{border-collapse:collapse}"
    "th,td{padding:.2rem .7rem;text-align:right;border-bottom:1px solid #e4e4e4}"
    "th:first-child,td:first-child{text-align:left}.quiet{color:#666}img,svg{display:block}";

}  // namespace

std::string html_page(const std::string& title, const std::string& style, const std::string& body) {
  return "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width\"><title>" +
         escape_html(title) + "</title><style>" + kCommonStyle + style + "</style>\n" + body +
         "</html>\n";
}

std::string url_of(const std::string& path) {
  constexpr const char* kHex = "0123456789ABCDEF";
  std::string result;
  for (const unsigned char c : path) {
    if (std::isalnum(c) || std::string_view("/._-~").find(char(c)) != std::string_view::npos) {
      result += char(c);
    } else {
      result += {'%', kHex[c >> 4], kHex[c & 15]};
    }
  }
  return result;
}

std::string html_link(const std::string& path, const std::string& text) {
  return "<a href=\"" + url_of(path) + "\">" + escape_html(text) + "</a>";
}

std::string html_cell(const std::string& text) { return "<td>" + escape_html(text) + "</td>"; }

std::string html_heading(const std::string& text) { return "<th>" + escape_html(text) + "</th>"; }

std::string html_picture(const Rgb8Image& image, const std::string& alternative) {
  return "<img alt=\"" + escape_html(alternative) + "\" width=\"" + std::to_string(image.width) +
         "\" height=\"" + std::to_string(image.height) + "\" src=\"" + png_data_uri(image) + "\">";
}

std::string png_data_uri(const Rgb8Image& image) {
  const std::string png = encode_png(image);
  return "data:image/png;base64," + to_base64(std::as_bytes(std::span(png)));
}

std::string page_number(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) return to_text(value);
  const int whole = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  if (whole >= digits) return to_text(value, 0);
  const double scale = std::pow(10.0, digits - whole);
  return to_text(std::round(value * scale) / scale);
}

}  // namespace organbake
