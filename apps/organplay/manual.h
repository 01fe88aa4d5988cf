// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace organbake {

// The manual page for man(1), and the completions for a shell (bash or zsh), of the options that
// the program reads.
std::string manual_page(const CLI::App& app);
std::string completions(const CLI::App& app, const std::string& shell);

}  // namespace organbake
