// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "organbake/core/error.h"

namespace organbake {

// What is being written bears a temporary name: that of its target, this mark, and the number of
// the process that writes it.
inline constexpr std::string_view kTemporaryMark = ".tmp-";

// The temporary name under which this process is to write the file, beside it: ready to be renamed.
// Sweeps what killed processes left under the file's temporary names.
[[nodiscard]] std::filesystem::path temporary_file(const std::filesystem::path& file);

// Removes a file or a folder, as well as the system lets us: a fault that has passed at the second
// try leaves nothing behind.
void remove_all_of(const std::filesystem::path& path);

// Removes from a folder what killed processes left under temporary names that begin with `prefix`,
// up to and with the mark; under any, where none is given.
void remove_stale_temporaries(const std::filesystem::path& folder, const std::string& prefix);

// An empty folder of its own for a test or a measurement, removed with everything in it.
class TemporaryFolder {
 public:
  // Throws IoError when the system's temporary folder takes none.
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "organbake-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw IoError::writing(name, std::strerror(errno));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // what cannot be removed is the system's to clear
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace organbake
