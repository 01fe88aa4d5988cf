// SPDX-License-Identifier: Apache-2.0
#include "core/kernel_files.h"

#include <fstream>

namespace organbake {

std::optional<double> number_behind(const std::string& word, const std::filesystem::path& file) {
  std::ifstream text(file);
  std::string read;
  double number = 0;
  while (text >> read) {
    if (read == word && text >> number) return number;
  }
  return std::nullopt;
}

}  // namespace organbake
