// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// Reads a whole file. Throws NoInputError when it is missing, is a folder, a pipe or a device, or
// cannot be opened; BadDataError when it is larger than max_bytes; IoError when the system fails
// half-way. Never waits for who writes into a pipe.
std::vector<std::byte> read_file(const std::filesystem::path& path,
                                 std::uint64_t max_bytes = std::uint64_t{1} << 36);
std::string read_text_file(const std::filesystem::path& path,
                           std::size_t max_bytes = std::size_t{1} << 28);
// Reads a file of a folder that may come from anyone, by its path below that folder. Throws
// BadDataError when it is missing or anything but a regular file, when a link leads to it, even one
// on the way below the folder, and when it is larger than max_bytes; IoError as read_file().
std::vector<std::byte> read_file_inside(const std::filesystem::path& folder,
                                        const std::filesystem::path& file, std::uint64_t max_bytes);

// Its first bytes, fewer where it ends before. Throws as read_file() does.
std::string read_beginning(const std::filesystem::path& path, std::size_t bytes);

// Where a result of that name is to be written: behind a symbolic link. Throws IoError for what is
// there and no regular file: a folder, a device, a pipe.
[[nodiscard]] std::filesystem::path file_to_write(const std::filesystem::path& path);

// Writes through a temporary name in the same folder and renames it: the file is there whole or
// not at all. Throws IoError (also when the disk is full, and see file_to_write) and leaves nothing
// behind.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

// Makes a folder, and those above it, where they are missing. Throws IoError (writing).
void make_folder(const std::filesystem::path& folder);

// A folder that appears at `target` complete or not at all. Files are written below path();
// commit() renames it into place (an existing target is replaced when `replace`); without commit()
// the destructor removes everything. Temporary names carry the process id, so what a killed
// process left is recognised and swept by the next AtomicFolder for the same target.
class AtomicFolder {
 public:
  explicit AtomicFolder(std::filesystem::path target);
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  const std::filesystem::path& path() const { return temporary_; }
  enum class IfExists { replace, keep_existing };
  // Returns false when the target existed and was kept.
  bool commit(IfExists if_exists = IfExists::replace);

  // Only removes what killed processes left, for a target that needs no writing.
  static void sweep(const std::filesystem::path& target);
  // The same for every target in a folder that holds nothing but ours.
  static void sweep_inside(const std::filesystem::path& folder);

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  bool committed_ = false;
};

// Where the running program lies. Throws IoError (reading).
std::filesystem::path program_folder();

// Where the modules lie that are loaded when something asks for them: the next lib/organbake above
// the code that asks, be it of a program in bin, of a module, or of Python's below lib/python3.
std::filesystem::path module_folder();
std::filesystem::path module_folder_above(const std::filesystem::path& code);
// The files of those that this process has loaded.
std::vector<std::filesystem::path> loaded_modules();
// Loads lib/organbake/<name>.so until the program ends, for the libraries behind it are not made to
// be unloaded, and returns its function `door`. Throws Error (internal) where one is missing.
void* module_door(const std::string& name, const char* door);

// All regular files below `folder`, relative, in byte order of their generic names.
std::vector<std::filesystem::path> list_files(const std::filesystem::path& folder);
// The same with all else that is no folder: links, pipes, devices.
std::vector<std::filesystem::path> list_all_but_folders(const std::filesystem::path& folder);
// Those that lie in the folder itself, by the numbers in their names: frame2 before frame10.
std::vector<std::filesystem::path> list_numbered_files(const std::filesystem::path& folder);

// The number behind a word, as the files below /proc and /sys tell it: "MemTotal:  24683204 kB",
// "inactive_file 4096". Nothing where the file or the word is not there.
std::optional<double> number_behind(const std::string& word, const std::filesystem::path& file);

// Writes a result and sees that it got there. Throws IoError when it didn't, for example
// because the disk behind it is full.
void write_to_stdout(std::string_view text);

// A file's ending in lower case, with its dot: ".png".
std::string lower_ending(const std::filesystem::path& file);

// PNG or JPEG by its name.
bool is_picture_name(const std::filesystem::path& file);
// These or EXR: what a frame of a clip may be.
bool is_frame_name(const std::filesystem::path& file);

// A surface mesh of any kind that is read, by its name.
bool is_mesh_name(const std::filesystem::path& file);

}  // namespace organbake
