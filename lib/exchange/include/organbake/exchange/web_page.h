// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"

namespace organbake {

// What a page is made of beside the organ, as it lies in share/organbake/web.
struct WebPlayer {
  // page.html, page.css, organ.js and webgl.js, painter.js, headset.js and page.js
  std::string page, style, loader, script;
  std::vector<std::byte> module, shaders;  // organ.wasm, organ.glsl
};

// Throws NoInputError for what is missing; of the module it says how it is built.
WebPlayer read_web_player(const std::filesystem::path& folder);

// One self-contained page in which the organ can be looked at and poked. Throws as web_pack() does.
std::string web_page(const Bundle& bundle, const WebPlayer& player, const RunContext& context = {});

// A bundle as the player in a page reads it (bundle/bundle_pack.h), the same bytes for any number
// of threads. Throws BadDataError for a bundle too large for it, CancelledError.
std::vector<std::byte> web_pack(const Bundle& bundle, const RunContext& context = {});

}  // namespace organbake
