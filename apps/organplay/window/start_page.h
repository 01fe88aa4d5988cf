// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace organbake {

// What is there without a bundle: how to get one, and a field for its folder. Returns the folder to
// open, empty as long as there is none. `problem` is shown, when the last one could not be opened.
class StartPage {
 public:
  std::string show(const std::string& problem);

 private:
  char folder_[1024] = "";
};

}  // namespace organbake
