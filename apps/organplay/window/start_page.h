// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/player/bundle_list.h"

namespace organbake {

// What is there without a bundle: how to get one, the folders round here with the bundles among
// them, and a field for the path of one. Returns the folder to
// open, empty as long as there is none. `problem` is shown, when the last one could not be opened.
class StartPage {
 public:
  std::string show(const std::string& problem);

 private:
  std::string chosen_in_list();
  void go_to(const std::filesystem::path& folder);

  char folder_[1024] = "";
  std::filesystem::path listed_;
  std::vector<ListedFolder> list_;
};

}  // namespace organbake
