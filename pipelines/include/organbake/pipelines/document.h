// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace organbake {

// A JSON or YAML document that remembers where it came from, so that errors can name the line.
class Document {
 public:
  // Throw BadDataError (JSON) or RecipeError (YAML) with file, line and column.
  static Document parse_json(std::string text, std::string name);
  static Document parse_yaml(std::string text, std::string name);

  const std::string& name() const { return name_; }
  const nlohmann::json& json() const { return *json_; }
  // Replaces or adds a value; `origin` ("--set decimate.faces=9") then stands for the line.
  void set(const std::string& pointer, const nlohmann::json& value, const std::string& origin);
  void remove(const std::string& pointer);

  // "recipe.yaml:7" for the key that a JSON pointer leads to, or as much of it as there is.
  std::string location(const std::string& pointer) const;

 private:
  Document(std::string text, std::string name, nlohmann::json json);

  std::string text_;
  std::string name_;
  std::shared_ptr<nlohmann::json> json_;
  std::map<std::string, std::string> origins_;  // pointer → origin of what was set later
};

// A scalar as YAML's core schema reads it: true, 12, 0.5, null, or else a text.
nlohmann::json plain_scalar(const std::string& text);

}  // namespace organbake
