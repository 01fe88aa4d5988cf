// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/layer_set.h"

#include <utility>

#include "organbake/core/error.h"

namespace organbake {
namespace {

const std::vector<std::pair<std::string, bool LayerSet::*>>& layers() {
  static const std::vector<std::pair<std::string, bool LayerSet::*>> all = {
      {"depth", &LayerSet::depth}, {"flow", &LayerSet::flow}, {"normals", &LayerSet::normals},
      {"mask", &LayerSet::mask},   {"id", &LayerSet::id},     {"weight", &LayerSet::weight}};
  return all;
}

void add(const std::string& name, LayerSet& set) {
  bool known = false;
  for (const auto& [of, member] : layers()) {
    if (name != "all" && name != of) continue;
    set.*member = known = true;
  }
  if (known) return;
  std::string all;
  for (const std::string& one : layer_names()) all += one + ", ";
  throw UsageError("'" + name + "' is no layer; take any of " + all + "or all");
}

}  // namespace

const std::vector<std::string>& layer_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& layer : layers()) all.push_back(layer.first);
    return all;
  }();
  return names;
}

LayerSet layers_from(std::string_view text) {
  LayerSet set;
  while (true) {
    const std::size_t comma = text.find(',');
    add(std::string(text.substr(0, comma)), set);
    if (comma == std::string_view::npos) return set;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace organbake
