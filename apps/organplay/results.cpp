// SPDX-License-Identifier: Apache-2.0
#include "results.h"

#include "organbake/core/files.h"

namespace organbake {

void Results::wrote(const std::string& option, const std::filesystem::path& path) {
  add(option, path.string(), path.string() + "\n");
}

void Results::add(const std::string& key, Json value, const std::string& text) {
  if (as_json_) {
    object_[key] = std::move(value);
  } else if (!text.empty()) {
    write_to_stdout(text);
  }
}

void Results::finish() const {
  if (!as_json_) return;
  // A comparison is a document of its own.
  const auto comparison = object_.find("comparison");
  const bool alone = object_.size() == 1 && comparison != object_.end();
  write_to_stdout(json_text(alone ? *comparison : object_));
}

}  // namespace organbake
