// SPDX-License-Identifier: GPL-3.0-or-later
// The JSON Schemas of all documents, how a document is held against its own (valijson), and what
// all HTML pages share.
#include "organbake/pipelines/documents.h"

#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "embedded_files.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace {

constexpr const char* kRecipe = "recipe";  // made from the option lists, not written by hand
constexpr std::string_view kSchemaEnding = ".schema.json";

}  // namespace

std::vector<std::string> schema_names() {
  std::vector<std::string> names = {kRecipe};
  for (const EmbeddedFile& file : embedded_files()) {
    if (!file.name.ends_with(kSchemaEnding)) continue;
    names.emplace_back(file.name.substr(0, file.name.size() - kSchemaEnding.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string schema_text(const std::string& name) {
  if (name == kRecipe) return recipe_schema().dump(2) + "\n";
  for (const EmbeddedFile& file : embedded_files()) {
    if (file.name == name + std::string(kSchemaEnding)) return std::string(file.text);
  }
  throw UsageError("there is no schema '" + name + "'" + suggestion(name, schema_names()) +
                   " ('organbake schema' lists them)");
}

std::string schema_of(const Document& document) {
  const nlohmann::json& json = document.json();
  const std::string id = json.is_object() && json.contains("schema") && json["schema"].is_string()
                             ? json["schema"].get<std::string>()
                             : "";
  for (const std::string& name : schema_names()) {
    if (id.starts_with("organbake/" + name + "/")) return name;
  }
  throw BadDataError(document.name(), id.empty() ? "has no key 'schema', so it is none of ours"
                                                 : "its schema '" + id + "' is not known");
}

void check_document(const Document& document, const std::string& schema_name) {
  const auto schema = nlohmann::json::parse(schema_text(schema_name));
  if (const auto error = schema_error(document, schema)) throw BadDataError(*error);
}

void check_json_file(const std::filesystem::path& file, const std::string& schema_name) {
  check_document(Document::parse_json(read_text_file(file), file.string()), schema_name);
}

namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

struct Finding {
  Pointer pointer;
  std::string message;  // valijson's
};

// valijson writes a place as "<root>", "[decimate]", "[faces]"; list items carry their index.
Pointer pointer_from(const std::vector<std::string>& context) {
  Pointer pointer;
  for (const std::string& part : context) {
    if (part.size() > 2 && part.front() == '[') pointer /= part.substr(1, part.size() - 2);
  }
  return pointer;
}

std::size_t depth(const Pointer& pointer) {
  std::size_t parts = 0;
  for (Pointer rest = pointer; !rest.empty(); rest.pop_back()) ++parts;
  return parts;
}

constexpr std::string_view kUnknownKey = "Object contains a property";

// The deepest finding is the cause; its parents are reported because of it. Of several at one
// place, an unknown key explains the others best: a mistyped one is missing as well.
bool better(const Finding& finding, const std::optional<Finding>& best) {
  if (!best || depth(finding.pointer) != depth(best->pointer)) {
    return !best || depth(finding.pointer) > depth(best->pointer);
  }
  return finding.message.starts_with(kUnknownKey) && !best->message.starts_with(kUnknownKey);
}

std::optional<Finding> validate(const Json& document, const Json& schema) {
  valijson::Schema compiled;
  valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(schema),
                                          compiled);
  valijson::ValidationResults results;
  valijson::Validator validator(valijson::Validator::kStrongTypes);
  if (validator.validate(compiled, valijson::adapters::NlohmannJsonAdapter(document), &results)) {
    return std::nullopt;
  }
  std::optional<Finding> deepest;
  valijson::ValidationResults::Error error;
  while (results.popError(error)) {
    Finding finding{pointer_from(error.context), error.description};
    if (better(finding, deepest)) deepest = finding;
  }
  return deepest;
}

// The part of a schema that speaks about a place of the document; null when it is not plain.
Json schema_at(Json schema, const Pointer& pointer) {
  std::vector<std::string> parts;
  for (Pointer rest = pointer; !rest.empty(); rest.pop_back()) parts.push_back(rest.back());
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    if (schema.contains("properties") && schema["properties"].contains(*part)) {
      schema = Json(schema["properties"][*part]);
    } else if (schema.contains("items")) {
      schema = Json(schema["items"]);
    } else {
      return nullptr;
    }
  }
  return schema;
}

std::string expectation(const Json& schema) {
  static const std::map<std::string, std::string> kTypes = {
      {"integer", "a whole number"}, {"number", "a number"}, {"string", "a text"},
      {"boolean", "true or false"},  {"array", "a list"},    {"object", "a group of keys"}};
  if (!schema.is_object()) return {};
  if (schema.contains("enum")) return "one of " + schema["enum"].dump();
  if (schema.contains("const")) return schema["const"].get<std::string>();
  if (schema.contains("anyOf")) return joined(schema["anyOf"], ", or ", expectation);
  const auto type = kTypes.find(schema.value("type", ""));
  std::string text = type == kTypes.end() ? "" : type->second;
  if (schema.contains("minimum")) text += ", at least " + schema["minimum"].dump();
  if (schema.contains("exclusiveMinimum")) text += ", above " + schema["exclusiveMinimum"].dump();
  if (schema.contains("maximum")) text += ", at most " + schema["maximum"].dump();
  if (schema.contains("minItems")) text += " of at least " + schema["minItems"].dump();
  if (schema.contains("maxItems")) text += ", at most " + schema["maxItems"].dump();
  if (schema.contains("pattern")) text += " like " + schema["pattern"].get<std::string>();
  return text;
}

std::string dotted(const Pointer& pointer) {
  std::string text;
  for (char c : pointer.to_string()) text += c == '/' ? '.' : c;
  return text.empty() ? "the document" : text.substr(1);
}

// valijson puts the key in question last, in quotes.
std::string quoted_name(const std::string& message) {
  const std::size_t end = message.rfind('\'');
  if (end == std::string::npos || end == 0) return {};
  const std::size_t begin = message.rfind('\'', end - 1) + 1;
  return message.substr(begin, end - begin);
}

std::string shortened(const Json& value) {
  constexpr std::size_t kLongest = 60;
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "…";
}

std::string unknown_key(const Document& document, Finding finding, const Json& schema) {
  const std::string key = quoted_name(finding.message);
  std::vector<std::string> known;
  const Json place = schema_at(schema, finding.pointer);
  if (place.is_object() && place.contains("properties")) {
    for (const auto& [name, ignored] : place["properties"].items()) known.push_back(name);
  }
  finding.pointer /= key;
  return document.location(finding.pointer.to_string()) + ": unknown key '" +
         dotted(finding.pointer) + "'" + suggestion(key, known);
}

// Which numbers a schema of an option takes.
NumberRange range_of(const Json& schema) {
  NumberRange range;
  const Json& numbers = schema.contains("anyOf") ? schema["anyOf"].front() : schema;
  if (numbers.contains("minimum")) range.min = numbers["minimum"].get<double>();
  if (numbers.contains("maximum")) range.max = numbers["maximum"].get<double>();
  return range;
}

// What may have been meant: a name like it, or the number in other units.
std::string meant_value(const Json& schema, const Json& value) {
  if (!schema.is_object()) return {};
  if (value.is_string() && schema.contains("enum") && schema["enum"].front().is_string())
    return suggestion(value.get<std::string>(), schema["enum"]);
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  return value.is_number() || value.is_string() ? meant_number(range_of(schema), text) : "";
}

std::string sentence(const Document& document, const Finding& finding, const Json& schema) {
  const std::string where = document.location(finding.pointer.to_string()) + ": ";
  const std::string what = dotted(finding.pointer);
  if (finding.message.starts_with("Missing required property")) {
    return where + what + " lacks the key '" + quoted_name(finding.message) + "'";
  }
  if (finding.message.starts_with(kUnknownKey)) {
    return unknown_key(document, finding, schema);
  }
  const std::string value = shortened(document.json().at(finding.pointer));
  const Json place = schema_at(schema, finding.pointer);
  const std::string expected = expectation(place);
  return where + what + " is " + value +
         (expected.empty() ? ": " + finding.message : "; it must be " + expected) +
         meant_value(place, document.json().at(finding.pointer));
}

}  // namespace

std::optional<std::string> schema_error(const Document& document, const Json& schema) {
  const std::optional<Finding> finding = validate(document.json(), schema);
  if (!finding) return std::nullopt;
  return sentence(document, *finding, schema);
}

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
