// SPDX-License-Identifier: GPL-3.0-or-later
// JSON and YAML documents that remember the line of each key, so that errors can name it.
#include "organbake/pipelines/document.h"

#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

using SortedJson = nlohmann::json;

// Aliases let a few lines of YAML stand for any number of values.
constexpr std::size_t kMostNodes = 20000;

std::string at_line(const std::string& name, const YAML::Mark& mark) {
  return name + ":" + std::to_string(mark.line + 1);
}

template <class T>
bool reads_as(const std::string& text, T& value) {
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(begin, end, value);
  return result.ec == std::errc() && result.ptr == end;
}

class YamlToJson {
 public:
  explicit YamlToJson(const std::string& name) : name_(name) {}

  SortedJson convert(const YAML::Node& node) {
    if (++nodes_ > kMostNodes) throw RecipeError(name_ + ": has too many values");
    switch (node.Type()) {
      case YAML::NodeType::Map:
        return convert_map(node);
      case YAML::NodeType::Sequence: {
        SortedJson array = SortedJson::array();
        for (const YAML::Node& item : node) array.push_back(convert(item));
        return array;
      }
      case YAML::NodeType::Scalar:
        return node.Tag() == "!" ? SortedJson(node.Scalar()) : plain_scalar(node.Scalar());
      default:
        return nullptr;
    }
  }

 private:
  SortedJson convert_map(const YAML::Node& node) {
    SortedJson object = SortedJson::object();
    for (const auto& item : node) {
      const std::string where = at_line(name_, item.first.Mark());
      if (!item.first.IsScalar()) throw RecipeError(where + ": a key must be a plain word");
      const std::string& key = item.first.Scalar();
      if (object.contains(key)) throw RecipeError(where + ": '" + key + "' is there twice");
      object[key] = convert(item.second);
    }
    return object;
  }

  const std::string& name_;
  std::size_t nodes_ = 0;
};

// The mark of a key (or list item), or of the deepest part of the pointer that exists.
YAML::Mark find_mark(YAML::Node node, const SortedJson::json_pointer& pointer) {
  std::vector<std::string> parts;
  for (auto rest = pointer; !rest.empty(); rest.pop_back()) parts.push_back(rest.back());
  YAML::Mark mark = node.Mark();
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    YAML::Node next;
    std::size_t index = 0;
    if (node.IsSequence() && reads_as(*part, index) && index < node.size()) {
      next.reset(node[index]);
      mark = next.Mark();
    } else if (node.IsMap()) {
      for (const auto& item : node) {
        if (item.first.IsScalar() && item.first.Scalar() == *part) {
          next.reset(item.second);
          mark = item.first.Mark();
        }
      }
    }
    if (!next.IsDefined() || next.IsNull()) break;
    node.reset(next);
  }
  return mark;
}

}  // namespace

SortedJson plain_scalar(const std::string& text) {
  if (text.empty() || text == "~" || text == "null") return nullptr;
  if (text == "true") return true;
  if (text == "false") return false;
  std::int64_t integer = 0;
  if (reads_as(text, integer)) return integer;
  double number = 0;
  if (reads_as(text, number) && std::isfinite(number)) return number;
  return text;
}

Document::Document(std::string text, std::string name, SortedJson json)
    : text_(std::move(text)),
      name_(std::move(name)),
      json_(std::make_shared<SortedJson>(std::move(json))) {}

Document Document::parse_json(std::string text, std::string name) {
  SortedJson json = parse_sorted_json(text, name);
  return {std::move(text), std::move(name), std::move(json)};
}

Document Document::parse_yaml(std::string text, std::string name) {
  try {
    SortedJson json = YamlToJson(name).convert(YAML::Load(text));
    return {std::move(text), std::move(name), std::move(json)};
  } catch (const YAML::DeepRecursion&) {
    throw RecipeError(name + ": is nested too deeply");
  } catch (const YAML::Exception& error) {
    throw RecipeError(at_line(name, error.mark) + ": " + error.msg);
  }
}

void Document::set(const std::string& pointer, const SortedJson& value, const std::string& origin) {
  try {
    const SortedJson::json_pointer target(pointer);
    // The outermost that is new: the groups of keys that it is the first in stand nowhere else.
    SortedJson::json_pointer first = target;
    while (!first.empty() && !json_->contains(first.parent_pointer())) first.pop_back();
    (*json_)[target] = value;
    origins_[first.to_string()] = origin;
  } catch (const SortedJson::exception&) {
    throw RecipeError(origin + ": " + name_ + " holds something else than keys there");
  }
}

void Document::remove(const std::string& pointer) {
  const SortedJson::json_pointer target(pointer);
  if (json_->contains(target)) (*json_)[target.parent_pointer()].erase(target.back());
}

std::string Document::location(const std::string& pointer) const {
  // The longest that leads there: the map holds it after the shorter ones.
  for (auto set = origins_.rbegin(); set != origins_.rend(); ++set) {
    if ((pointer + "/").starts_with(set->first + "/")) return set->second;
  }
  try {
    // JSON is YAML, so one parser that keeps its marks serves both; it is slow, and asked only
    // when there is an error to tell.
    return at_line(name_, find_mark(YAML::Load(text_), SortedJson::json_pointer(pointer)));
  } catch (const YAML::Exception&) {
    return name_;
  }
}

}  // namespace organbake
