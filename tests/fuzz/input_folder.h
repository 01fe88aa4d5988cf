// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "organbake/core/temporary_folder.h"

namespace organbake {

// Has temporary files of this process made in memory, where the system has a place for it and
// nobody asked for another one. For the first line of main.
void keep_temporary_files_in_memory();

// The folder that a reader's input lies in. What the input before it left there is removed.
class InputFolder {
 public:
  // The whole input as one file.
  std::filesystem::path file(const std::string& name, std::span<const std::byte> bytes) const;

  // An input that stands for several files: each begins with kPartMark and a byte that says which
  // of `names` it is called. Returns the folder that they lie in.
  std::filesystem::path parts(const std::vector<std::string>& names,
                              std::span<const std::byte> bytes) const;

 private:
  void clear() const;

  TemporaryFolder folder_;
};

// Text, so that cutting and splicing leave the parts behind it whole.
inline constexpr std::string_view kPartMark = "\n<part>";
std::string joined_parts(const std::vector<std::pair<std::size_t, std::string>>& files);

}  // namespace organbake
