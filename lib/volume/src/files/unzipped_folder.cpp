// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/unzipped_folder.h"

#include <minizip/unzip.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{1} << 34;  // 16 GiB
constexpr std::size_t kMostFiles = 100'000;
constexpr int kNumberDigits = 6;

struct CloseZip {
  void operator()(void* zip) const { unzClose(zip); }
};

[[noreturn]] void damaged(const fs::path& zip) { throw BadDataError(zip, "is a damaged zip"); }

struct Entry {
  std::string name;  // with its folders
  std::uint64_t bytes = 0;
  bool encrypted = false;

  std::string base() const { return name.substr(name.find_last_of("/\\") + 1); }
  bool wanted() const {
    return bytes > 0 && !base().empty() && !base().starts_with("._") &&
           name.find("__MACOSX/") == std::string::npos;
  }
};

Entry entry_of(void* zip, const fs::path& path) {
  unz_file_info64 info{};
  if (unzGetCurrentFileInfo64(zip, &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK)
    damaged(path);
  Entry entry;
  entry.name.resize(info.size_filename);
  if (unzGetCurrentFileInfo64(zip, nullptr, entry.name.data(), info.size_filename, nullptr, 0,
                              nullptr, 0) != UNZ_OK)
    damaged(path);
  entry.bytes = info.uncompressed_size;
  entry.encrypted = info.flag & 1;
  return entry;
}

std::vector<std::byte> content_of(void* zip, const Entry& entry, const fs::path& path) {
  if (unzOpenCurrentFile(zip) != UNZ_OK) damaged(path);
  constexpr std::size_t kPiece = 1 << 20;
  std::vector<std::byte> bytes;
  // What the entry claims is not trusted with memory before it is there.
  for (;;) {
    const std::size_t had = bytes.size();
    bytes.resize(had + kPiece);
    const int got = unzReadCurrentFile(zip, bytes.data() + had, kPiece);
    if (got < 0) damaged(path);
    bytes.resize(had + static_cast<std::size_t>(got));
    if (got == 0) break;
    if (bytes.size() > entry.bytes) damaged(path);
  }
  // Closing compares the checksum.
  if (unzCloseCurrentFile(zip) != UNZ_OK || bytes.size() != entry.bytes) damaged(path);
  return bytes;
}

}  // namespace

bool starts_zip(std::string_view first_bytes) { return first_bytes.starts_with("PK\x03\x04"); }

UnzippedFolder::UnzippedFolder(const fs::path& zip) : zip_(zip) {
  const std::unique_ptr<void, CloseZip> open(unzOpen64(zip.c_str()));
  if (!open) damaged(zip);
  std::uint64_t total = 0;
  std::size_t files = 0;
  for (int at = unzGoToFirstFile(open.get()); at == UNZ_OK; at = unzGoToNextFile(open.get())) {
    const Entry entry = entry_of(open.get(), zip);
    if (!entry.wanted()) continue;
    if (entry.encrypted) throw BadDataError(zip, "is encrypted; unpack it first");
    total += entry.bytes;
    if (++files > kMostFiles || total > kMostUnpackedBytes) {
      throw BadDataError(zip, "holds more than a scan would (" + std::to_string(total >> 20) +
                                  " MB in " + std::to_string(files) +
                                  " files so far); unpack it and give the folder of one series");
    }
    // Numbers keep apart what has the same name in two folders, and keep the zip's order.
    path_ = folder_.path() / (padded(files, kNumberDigits) + "_" + entry.base());
    const std::vector<std::byte> content = content_of(open.get(), entry, zip);
    // A zip may hold itself without end.
    if (starts_zip({reinterpret_cast<const char*>(content.data()), content.size()}))
      throw BadDataError(zip, "holds another zip (" + entry.name + "); unpack it first");
    write_file_atomically(path_, content);
  }
  if (files == 0) throw BadDataError(zip, "is a zip without files");
  if (files > 1) path_ = folder_.path();
}

std::string UnzippedFolder::about_the_zip(const std::string& message) const {
  std::string text = message;
  const std::string inside = folder_.path().string();
  for (std::size_t at; (at = text.find(inside)) != std::string::npos;)
    text.replace(at, inside.size(), zip_.string());
  return text;
}

}  // namespace organbake
