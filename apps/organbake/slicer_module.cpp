// SPDX-License-Identifier: GPL-3.0-or-later
#include "slicer_module.h"

#include <algorithm>
#include <cctype>
#include <limits>

#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"

namespace organbake {
namespace {

std::string element(const std::string& name, const std::string& text, int depth) {
  return std::string(std::size_t(2 * depth), ' ') + "<" + name + ">" + escape_html(text) + "</" +
         name + ">\n";
}

// "photo_size" → "Photo size", as the panel shows it.
std::string label_of(std::string name, const std::string& unit = "") {
  std::replace(name.begin(), name.end(), '_', ' ');
  name.front() = char(std::toupper(static_cast<unsigned char>(name.front())));
  return unit.empty() ? name : name + " (" + unit + ")";
}

std::string capital(std::string text) {
  if (!text.empty()) text.front() = char(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

// One parameter: its tag with attributes, then what all have in the order of the schema.
struct Parameter {
  std::string tag = {}, attributes = {}, name = {}, flag = {}, description = {}, label = {};
  std::string default_text = {}, channel = {}, rest = {};

  std::string xml() const {
    std::string xml = "    <" + tag + attributes + ">\n" + element("name", name, 3) +
                      element("longflag", flag, 3) + element("description", description, 3) +
                      element("label", label, 3);
    if (!default_text.empty()) xml += element("default", default_text, 3);
    if (!channel.empty()) xml += element("channel", channel, 3);
    return xml + rest + "    </" + tag + ">\n";
  }
};

// ---- inputs and the output

std::string tag_of(InputKind kind) {
  if (kind == InputKind::mesh) return "geometry";
  return kind == InputKind::volume ? "image" : "file";
}

std::string attributes_of(const StageInput& input) {
  if (input.kind == InputKind::mesh)
    return " type=\"model\" fileExtensions=\".vtk,.ply,.stl,.obj\"";
  if (input.kind != InputKind::volume) return "";
  return input.name == "mask" ? " type=\"label\"" : " type=\"scalar\"";
}

std::string flag_of(const StageInput& input) {
  Option option;
  option.name = input.flag.empty() ? input.name : input.flag;
  return option.flag();
}

std::string input_xml(const StageInput& input) {
  return Parameter{.tag = tag_of(input.kind),
                   .attributes = attributes_of(input),
                   .name = input.name,
                   .flag = flag_of(input),
                   .description = capital(input.help),
                   .label = label_of(input.name),
                   .channel = "input"}
      .xml();
}

std::string output_xml(const Stage& stage) {
  Parameter output{.name = "output", .flag = "--output", .label = "Output", .channel = "output"};
  if (!stage.single_file) {
    output.tag = "directory";
    output.description = "The folder to write";
    return output.xml();
  }
  const std::string ending = lower_ending(stage.outputs.front().file);
  output.tag = ending == ".ply" ? "geometry" : "file";
  output.attributes =
      (ending == ".ply" ? " type=\"model\"" : std::string()) + " fileExtensions=\"" + ending + "\"";
  output.description = "The file to write";
  return output.xml();
}

// ---- options

std::string type_of(const Option& option) {
  switch (option.kind) {
    case OptionKind::boolean:
      return "boolean";
    case OptionKind::integer:
      return "integer";
    case OptionKind::number:
      return "double";
    case OptionKind::choice:
      return "string-enumeration";
    case OptionKind::path:
      return "file";
    case OptionKind::vector:
      return "double-vector";
    case OptionKind::integers:
      return "integer-vector";
    default:
      return "string";  // "auto" is no number to Slicer
  }
}

// Slicer's whole numbers have 32 bits.
std::string bound_text(double bound, bool whole) {
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  if (!whole) return to_text(bound);
  return std::to_string(std::int64_t(std::clamp(bound, -kLargest, kLargest)));
}

// The schema wants all three; without both bounds the panel has a plain field.
std::string constraints_of(const Option& option) {
  const bool whole = option.kind == OptionKind::integer || option.kind == OptionKind::integers;
  const bool number =
      whole || option.kind == OptionKind::number || option.kind == OptionKind::vector;
  if (!number || !option.traits.min || !option.traits.max) return "";
  constexpr double kSteps = 1000;
  const double step = whole ? 1 : (*option.traits.max - *option.traits.min) / kSteps;
  return "      <constraints>\n" + element("minimum", bound_text(*option.traits.min, whole), 4) +
         element("maximum", bound_text(*option.traits.max, whole), 4) +
         element("step", to_text(step), 4) + "      </constraints>\n";
}

std::string option_xml(const Option& option) {
  Parameter parameter{.tag = type_of(option),
                      .name = option.name,
                      .flag = option.flag(),
                      .description = capital(option.traits.help),
                      .label = label_of(option.name, option.traits.unit),
                      .default_text = option_text(option.default_value),
                      .rest = constraints_of(option)};
  const bool* on = std::get_if<bool>(&option.default_value);
  if (on && *on) {
    // Slicer names a switch or leaves it out, so that one which is on needs its opposite.
    parameter.name = "no_" + option.name;
    parameter.flag = "--no-" + option.flag().substr(2);
    parameter.label = "Not: " + label_of(option.name);
    parameter.description = "Turns off: " + option.traits.help;
    parameter.default_text = "false";
  }
  for (const std::string& choice : option.traits.choices)
    parameter.rest += element("element", choice, 3);
  return parameter.xml();
}

std::string group(const std::string& label, const std::string& description,
                  const std::string& parameters) {
  if (parameters.empty()) return "";
  return "  <parameters>\n" + element("label", label, 2) + element("description", description, 2) +
         parameters + "  </parameters>\n";
}

}  // namespace

std::string slicer_module(const Stage& stage, const OptionList& options) {
  std::string files, settings;
  for (const StageInput& input : stage.inputs) files += input_xml(input);
  files += output_xml(stage);
  for (const Option& option : options.all()) settings += option_xml(option);
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n" +
         element("category", "Organbake", 1) + element("title", label_of(stage.name), 1) +
         element("description", capital(stage.summary) + ".", 1) + element("version", kVersion, 1) +
         element("documentation-url", "file:///usr/share/doc/organbake/html/slicer.html", 1) +
         element("license", "GPL-3.0-or-later", 1) +
         element("contributor", "The authors of organbake", 1) +
         group("Files", "What it reads and writes", files) +
         group("Options", "How it works", settings) + "</executable>\n";
}

}  // namespace organbake
