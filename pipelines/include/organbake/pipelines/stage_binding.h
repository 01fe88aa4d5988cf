// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/pipelines/stage.h"

namespace organbake {

template <class Options>
StageOptions options_from(const Options& values) {
  auto storage = std::make_shared<Options>(values);
  OptionList list;
  bind(list, *storage);
  return {storage, list, [storage] { return options_from(*storage); }};
}

// A stage's options with their defaults, as its description makes them.
template <class Options>
StageOptions make_options() {
  return options_from(Options());
}

}  // namespace organbake
