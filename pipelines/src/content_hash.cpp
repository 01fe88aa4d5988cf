// SPDX-License-Identifier: GPL-3.0-or-later
// What an input holds, as a hash: all files that belong to it, whichever of them was named
// (XXH3-128).
#include "organbake/pipelines/cache.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/sha256.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// A file that belongs to an input, under the name that counts for the content hash.
struct InputFile {
  std::string name;
  fs::path path;
};

// A mistyped path such as "/" must not be read for hours before anybody looks at it.
constexpr std::size_t kMaxFilesOfFolder = 20000;

std::string hex(XXH128_hash_t hash) {
  XXH128_canonical_t bytes;
  XXH128_canonicalFromHash(&bytes, hash);
  return hex_of(bytes.digest);
}

// A document may name what no file can be called.
bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::vector<InputFile> files_of_folder(const fs::path& folder) {
  std::vector<InputFile> files;
  for (const fs::path& file : list_files(folder)) {
    files.push_back({file.generic_string(), folder / file});
    if (files.size() > kMaxFilesOfFolder) {
      throw BadDataError(folder, "holds more than " + std::to_string(kMaxFilesOfFolder) +
                                     " files; give the folder of one series");
    }
  }
  if (files.empty()) throw NoInputError(folder, "is an empty folder");
  return files;
}

// MetaImage and NRRD headers may keep their voxels in another file, or in many. What the header
// says about it is read no further than needed: with anything but one plain name, everything in
// the folder counts.
std::vector<InputFile> files_of_header(const fs::path& header) {
  const std::string text = read_text_file(header, std::size_t{1} << 20);
  for (const std::string key : {"ElementDataFile", "data file:", "datafile:"}) {
    const std::size_t at = text.find(key);
    if (at == std::string::npos) continue;
    const std::size_t begin = text.find_first_not_of(" =\t", at + key.size());
    const std::size_t end = text.find_first_of("\r\n", begin);
    if (begin == std::string::npos) continue;
    const fs::path data = header.parent_path() / text.substr(begin, end - begin);
    if (is_file(data)) return {{"data", data}, {"header", header}};
  }
  return files_of_folder(header.parent_path().empty() ? fs::path(".") : header.parent_path());
}

// A NIfTI header and its voxels, "scan.hdr" and "scan.img", packed or not; none for other files.
std::vector<InputFile> files_of_pair(const fs::path& path) {
  std::vector<InputFile> files;
  for (const char* ending : {".hdr", ".img"}) {
    std::string name = path.filename().string();
    for (const std::string other : {".hdr", ".img"}) {
      const std::size_t at = name.rfind(other);
      if (at != std::string::npos) name.replace(at, other.size(), ending);
    }
    const fs::path file = path.parent_path() / name;
    if (name.find(ending) == std::string::npos || !is_file(file)) return {};
    files.push_back({ending, file});
  }
  return files;
}

// One file may stand for the series beside it, or for all that a DICOMDIR lists below it: whatever
// lies in its folder counts, and which file was named.
std::vector<InputFile> files_of_dicom(const fs::path& path) {
  const fs::path folder = path.parent_path();
  std::vector<InputFile> files = files_of_folder(folder.empty() ? fs::path(".") : folder);
  files.push_back({"the file that was named", path});
  return files;
}

std::vector<InputFile> files_of_photos(const fs::path& document) {
  std::vector<InputFile> files = {{"cameras.json", document}};
  for (const std::string& image : read_cameras(document).images) {
    files.push_back({image, document.parent_path() / image});
  }
  std::sort(files.begin(), files.end(),
            [](const InputFile& a, const InputFile& b) { return a.name < b.name; });
  return files;
}

// "a%20b.bin" → "a b.bin".
std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    const char* const digits = uri.data() + i + 1;
    const bool coded = uri[i] == '%' && i + 2 < uri.size() &&
                       std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2;
    text += coded ? static_cast<char>(code) : uri[i];
    if (coded) i += 2;
  }
  return text;
}

// A JSON document and the files beside it that items of its lists name under a key, each list with
// its own. What is no JSON, or names none, is one file.
std::vector<InputFile> files_of_document(const fs::path& document,
                                         const std::map<std::string, std::string>& keys) {
  std::vector<InputFile> files = {{document.filename().string(), document}};
  const auto json = nlohmann::json::parse(read_text_file(document), nullptr, false);
  if (!json.is_object()) return files;
  for (const auto& [list, key] : keys) {
    if (!json.contains(list) || !json[list].is_array()) continue;
    for (const auto& item : json[list]) {
      if (!item.is_object() || !item.contains(key) || !item[key].is_string()) continue;
      const auto name = item[key].get<std::string>();
      const fs::path file = document.parent_path() / (key == "uri" ? percent_decoded(name) : name);
      if (!name.starts_with("data:") && is_file(file)) files.push_back({name, file});
    }
  }
  return files;
}

// Cameras of any kind, with the images that they name.
std::vector<InputFile> files_of_posed(const fs::path& document) {
  std::vector<InputFile> files =
      files_of_document(document, {{"cameras", "image"}, {"frames", "file_path"}});
  std::sort(files.begin() + 1, files.end(),
            [](const InputFile& a, const InputFile& b) { return a.name < b.name; });
  return files;
}

// A COLMAP model of which one file is named: the others say lenses, frames and rigs.
std::vector<InputFile> files_of_colmap(const fs::path& named) {
  std::vector<InputFile> files;
  for (const char* stem : {"cameras", "frames", "images", "rigs"}) {
    const fs::path file = named.parent_path() / (stem + named.extension().string());
    if (is_file(file)) files.push_back({file.filename().string(), file});
  }
  return files;
}

bool is_colmap_file(const fs::path& path) {
  const std::string stem = path.stem().string(), ending = path.extension().string();
  return (stem == "cameras" || stem == "images") && (ending == ".txt" || ending == ".bin");
}

}  // namespace

bool has_dicom_mark(const fs::path& path) {
  const std::string first = read_beginning(path, 132);
  return first.size() == 132 && first.ends_with("DICM");
}

std::string quick_hash(std::string_view text) {
  return hex(XXH3_128bits(text.data(), text.size()));
}

namespace {

// use(bytes) for one piece of a file after the other.
template <class Use>
void read_in_blocks(const fs::path& path, const Use& use) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw NoInputError(path, std::string("cannot be opened: ") + std::strerror(errno));
  const std::unique_ptr<const int, void (*)(const int*)> closer(
      &file, [](const int* fd) { ::close(*fd); });
  std::vector<std::byte> block(std::size_t{1} << 18);
  while (true) {
    const ssize_t got = ::read(file, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw IoError::reading(path, std::strerror(errno));
    if (got == 0) return;
    use(std::span<const std::byte>(block).first(static_cast<std::size_t>(got)));
  }
}

std::vector<InputFile> files_of_input(InputKind kind, const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))
    throw NoInputError(path, "there is no such file or folder; correct the path");
  if (fs::is_directory(status)) {
    const bool may_be_folder = kind == InputKind::volume || kind == InputKind::frames ||
                               kind == InputKind::lenses || kind == InputKind::posed;
    if (may_be_folder) return files_of_folder(path);
    throw NoInputError(path, "is a folder, a file is needed");
  }
  if (!fs::is_regular_file(status)) throw NoInputError(path, "is not a regular file");
  if (kind == InputKind::photos) return files_of_photos(path);
  if ((kind == InputKind::posed || kind == InputKind::lenses) && is_colmap_file(path))
    return files_of_colmap(path);
  if (kind == InputKind::posed) return files_of_posed(path);
  if (kind == InputKind::mesh && lower_ending(path) == ".gltf")
    return files_of_document(path, {{"buffers", "uri"}});
  const std::string ending = path.extension().string();
  if (kind == InputKind::volume) {
    if (const auto pair = files_of_pair(path); !pair.empty()) return pair;
    if (has_dicom_mark(path)) return files_of_dicom(path);
  }
  if (kind == InputKind::volume && (ending == ".mhd" || ending == ".nhdr")) {
    return files_of_header(path);
  }
  return {{path.filename().string(), path}};
}

}  // namespace

std::string quick_hash_of_file(const fs::path& path) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              XXH3_freeState);
  XXH3_128bits_reset(state.get());
  read_in_blocks(path, [&](std::span<const std::byte> bytes) {
    XXH3_128bits_update(state.get(), bytes.data(), bytes.size());
  });
  return hex(XXH3_128bits_digest(state.get()));
}

std::string content_hash(InputKind kind, const fs::path& path, FileHasher hash_file) {
  const std::vector<InputFile> files = files_of_input(kind, path);
  if (files.size() == 1) return hash_file(files.front().path);
  std::string list;
  for (const InputFile& file : files) list += hash_file(file.path) + "  " + file.name + "\n";
  return hash_file == sha256_of_file ? sha256_hex(std::as_bytes(std::span(list)))
                                     : quick_hash(list);
}

std::string sha256_of_file(const fs::path& path) {
  Sha256 sum;
  read_in_blocks(path, [&](std::span<const std::byte> bytes) { sum.add(bytes); });
  return sum.hex();
}

}  // namespace organbake
