// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// A stage's options with their defaults, as its description makes them.
template <class Options>
StageOptions make_options() {
  auto storage = std::make_shared<Options>();
  OptionList list;
  bind(list, *storage);
  return {storage, list};
}

// The resolved options of a stage call, back in their struct.
template <class Options>
Options resolved_options(const std::string& options_json) {
  Options options;
  OptionList list;
  bind(list, options);
  set_from_json_text(list, options_json);
  return options;
}

}  // namespace organbake
