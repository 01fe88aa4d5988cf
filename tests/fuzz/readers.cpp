// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/readers.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "support/places.h"

namespace organbake {
namespace {

std::vector<FuzzReader> all_readers() {
  std::vector<FuzzReader> all;
  for (const auto& some : {file_readers(), bundle_readers(), algorithm_targets()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

// What a user can mend in a file. That the program is at fault, or the system, no input may claim.
bool is_refusal(ExitCode code) {
  return code == ExitCode::usage || code == ExitCode::bad_data || code == ExitCode::no_input ||
         code == ExitCode::bad_recipe;
}

}  // namespace

const std::vector<FuzzReader>& fuzz_readers() {
  static const std::vector<FuzzReader> readers = all_readers();
  return readers;
}

namespace {

std::filesystem::path archive_of(const FuzzReader& reader) {
  return in_clone("tests/fuzz/seeds") / (std::string(reader.name) + ".tar.gz");
}

Seeds archived(const FuzzReader& reader, std::string_view kind) {
  Seeds seeds;
  for (const auto& [name, bytes] : unpacked(archive_of(reader)))
    if (name.starts_with(kind)) seeds.push_back(bytes);
  return seeds;
}

}  // namespace

std::map<std::string, std::string> unpacked(const std::filesystem::path& archive) {
  if (!std::filesystem::exists(archive)) return {};
  const TemporaryFolder folder;
  const std::string unpack =
      "tar -xzf '" + archive.string() + "' -C '" + folder.path().string() + "'";
  if (std::system(unpack.c_str()) != 0) throw BadDataError(archive, "cannot be unpacked");
  std::map<std::string, std::string> files;
  for (const std::filesystem::path& file : list_files(folder.path()))
    files[file.string()] = read_text_file(folder.path() / file);
  return files;
}

Seeds seeds_of(const FuzzReader& reader) {
  return reader.made ? reader.made() : archived(reader, "seed");
}

Seeds refused_seeds_of(const FuzzReader& reader) { return archived(reader, "refused"); }

std::filesystem::path dictionary_of(const FuzzReader& reader) {
  if (!*reader.words) return {};
  return in_clone("tests/fuzz/words") / (std::string(reader.words) + ".dict");
}

Words words_of(const FuzzReader& reader) {
  Words words;
  if (!*reader.words) return words;
  std::istringstream lines(read_text_file(dictionary_of(reader)));
  for (std::string line; std::getline(lines, line);) {
    std::string& word = words.emplace_back();
    for (std::size_t i = 1; i + 1 < line.size(); ++i) {
      const bool escaped = line[i] == '\\';
      if (escaped && line[i + 1] == 'x') {
        word += static_cast<char>(std::stoi(line.substr(i + 2, 2), nullptr, 16));
        i += 3;
      } else {
        word += line[i += escaped];
      }
    }
  }
  return words;
}

const FuzzReader& fuzz_reader(std::string_view name) {
  std::string names;
  for (const FuzzReader& reader : fuzz_readers()) {
    if (reader.name == name) return reader;
    names += (names.empty() ? "" : ", ") + std::string(reader.name);
  }
  throw UsageError("there is no reader '" + std::string(name) + "'; there are " + names);
}

bool is_read(const FuzzReader& reader, std::span<const std::byte> bytes, const InputFolder& folder,
             std::string* refusal) {
  try {
    reader.read(bytes, folder);
    return true;
  } catch (const Error& error) {
    if (!is_refusal(error.code())) throw;
    if (refusal) *refusal = error.what();
    return false;
  }
}

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

namespace {

template <class List>
const auto& one_of(const List& list, RandomStream& random) {
  return *(std::begin(list) + static_cast<std::ptrdiff_t>(random.below(std::size(list))));
}

void flip_bits(std::string& bytes, RandomStream& random) {
  for (std::uint64_t n = 1 + random.below(4); n-- > 0;) {
    char& byte = bytes[random.below(bytes.size())];
    byte = static_cast<char>(byte ^ (1 << random.below(8)));
  }
}

void overwrite_byte(std::string& bytes, RandomStream& random) {
  bytes[random.below(bytes.size())] = static_cast<char>(random.below(256));
}

// A count, a length or an offset of 1, 2, 4 or 8 bytes in either order.
void overwrite_number(std::string& bytes, RandomStream& random) {
  const std::uint64_t values[] = {0,
                                  1,
                                  0x7F,
                                  0xFF,
                                  0x7FFF,
                                  0xFFFF,
                                  0x7FFFFFFF,
                                  0x80000000,
                                  0xFFFFFFFF,
                                  0x7FFFFFFFFFFFFFFF,
                                  ~std::uint64_t{0},
                                  bytes.size(),
                                  bytes.size() + 1,
                                  random.below(1u << 20)};
  const std::size_t widths[] = {1, 2, 4, 8};
  const std::size_t width = one_of(widths, random);
  if (bytes.size() < width) return;
  const std::uint64_t value = one_of(values, random);
  const std::size_t at = random.below(bytes.size() - width + 1);
  const bool big_endian = random.below(2) == 1;
  for (std::size_t i = 0; i < width; ++i)
    bytes[at + (big_endian ? width - 1 - i : i)] = static_cast<char>(value >> (8 * i));
}

bool in_number(char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-'; }

void replace_written_number(std::string& bytes, RandomStream& random) {
  const char* const numbers[] = {"0",          "-1",         "1",    "2147483647",
                                 "4294967295", "4294967296", "1e99", "-9223372036854775808",
                                 "nan",        "inf",        "",     "99999999999999999999",
                                 "1e-320",     "65536",      "0.5",  "1e19"};
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(random.below(bytes.size()));
  const auto first = std::find_if(from, bytes.end(), in_number);
  const auto last = std::find_if_not(first, bytes.end(), in_number);
  if (first != last) bytes.replace(first, last, one_of(numbers, random));
}

// A piece anywhere, rather short than long.
std::string_view piece_of(const std::string& bytes, RandomStream& random) {
  const std::size_t most =
      random.below(4) == 0 ? bytes.size() : std::min<std::size_t>(bytes.size(), 16);
  const std::size_t count = 1 + random.below(most);
  return std::string_view(bytes).substr(random.below(bytes.size() - count + 1), count);
}

void cut_out(std::string& bytes, RandomStream& random) {
  const std::string_view piece = piece_of(bytes, random);
  bytes.erase(static_cast<std::size_t>(piece.data() - bytes.data()), piece.size());
}

void put_in(std::string& bytes, std::string_view piece, RandomStream& random) {
  const std::string copy(piece);  // it may be a part of the bytes themselves
  bytes.insert(random.below(bytes.size() + 1), copy);
}

void put_over(std::string& bytes, std::string_view piece, RandomStream& random) {
  const std::string copy(piece);
  bytes.replace(random.below(bytes.size()), copy.size(), copy);
}

void change(std::string& bytes, const Seeds& seeds, const Words& words, RandomStream& random) {
  if (bytes.empty()) bytes = "0";
  switch (random.below(9)) {
    case 0:
      return flip_bits(bytes, random);
    case 1:
      return overwrite_byte(bytes, random);
    case 2:
    case 3:
      return overwrite_number(bytes, random);
    case 4:
      return replace_written_number(bytes, random);
    case 5:
      return cut_out(bytes, random);
    case 6:
      return put_in(bytes, piece_of(bytes, random), random);
    case 7:
      return put_over(bytes, piece_of(one_of(seeds, random), random), random);
    default:
      if (words.empty()) return flip_bits(bytes, random);
      return random.below(2) ? put_in(bytes, one_of(words, random), random)
                             : put_over(bytes, one_of(words, random), random);
  }
}

}  // namespace

std::string damaged_seed(const Seeds& seeds, const Words& words, RandomStream& random) {
  std::string bytes = one_of(seeds, random);
  for (std::uint64_t n = 1 + random.below(4); n-- > 0;) change(bytes, seeds, words, random);
  return bytes;
}

}  // namespace organbake
