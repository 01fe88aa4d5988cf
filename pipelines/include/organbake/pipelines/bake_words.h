// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace organbake {

// Stages name their options and inputs as their own commands take them: "--largest 2 keeps one
// more". The same text for a bake, which takes them by --set: "--set isosurface.largest=2 keeps …".
std::string in_bake_words(const std::string& stage, const std::string& text);

}  // namespace organbake
