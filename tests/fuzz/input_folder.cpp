// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/input_folder.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string_view>

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Not atomically: nobody else looks, and a rename more takes as long as many a reader.
void write(const fs::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string_view text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void keep_temporary_files_in_memory() {
  constexpr const char* kInMemory = "/dev/shm";
  constexpr int kKeepWhatIsSet = 0;
  if (::access(kInMemory, W_OK) == 0) ::setenv("TMPDIR", kInMemory, kKeepWhatIsSet);
}

void InputFolder::clear() const {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path()))
    fs::remove_all(entry.path());
}

fs::path InputFolder::file(const std::string& name, std::span<const std::byte> bytes) const {
  clear();
  write(folder_.path() / name, text(bytes));
  return folder_.path() / name;
}

fs::path InputFolder::parts(const std::vector<std::string>& names,
                            std::span<const std::byte> bytes) const {
  clear();
  std::string_view rest = text(bytes);
  for (std::size_t at = rest.find(kPartMark); at != rest.npos; at = rest.find(kPartMark)) {
    rest.remove_prefix(at + kPartMark.size());
    if (rest.empty()) break;
    const fs::path file =
        folder_.path() / names[static_cast<unsigned char>(rest[0]) % names.size()];
    rest.remove_prefix(1);
    fs::create_directories(file.parent_path());
    write(file, rest.substr(0, rest.find(kPartMark)));
  }
  return folder_.path();
}

std::string joined_parts(const std::vector<std::pair<std::size_t, std::string>>& files) {
  std::string all;
  for (const auto& [name, bytes] : files)
    all += std::string(kPartMark) + static_cast<char>(name) + bytes;
  return all;
}

}  // namespace organbake
