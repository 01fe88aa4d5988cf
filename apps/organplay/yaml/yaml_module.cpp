// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>
#include <string>

#include "organbake/pipelines/document.h"

// A module of its own, loaded when a data set's spec is YAML: the player needs no YAML otherwise.
// Throws what Document::parse_yaml() throws.
extern "C" __attribute__((visibility("default"))) void organplay_json_of_yaml(
    const std::string& yaml, const std::string& name, std::string& json) {
  json = organbake::Document::parse_yaml(yaml, name).json().dump();
}
