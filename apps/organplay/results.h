// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "organbake/bundle/json_fields.h"

namespace organbake {

// What a run prints on stdout: its results as lines, one by one as they come, or under --json one
// object in the end.
class Results {
 public:
  explicit Results(bool as_json) : as_json_(as_json) {}

  void wrote(const std::string& option, const std::filesystem::path& path);
  // A result under a key; `text` is what stands for it among the lines.
  void add(const std::string& key, Json value, const std::string& text);
  // Throws IoError when stdout doesn't take it, as the others do.
  void finish() const;

 private:
  bool as_json_;
  Json object_ = Json::object();
};

}  // namespace organbake
