// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Every reader of the project behind one door, the inputs that it is given, and how these are
// damaged.

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"

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

using Seeds = std::vector<std::string>;
using Words = std::vector<std::string>;

// One reader of the project as a user's file reaches it: any bytes at all are read, or refused with
// one of the project's own errors (core/error.h). So are, by the algorithms, the meshes and options
// that any bytes stand for (Drawn).
struct FuzzReader {
  const char* name;
  void (*read)(std::span<const std::byte> bytes, const InputFolder& folder);
  const char* words;  // of the format, for what puts inputs together: words/NAME.dict; "": none
  int mutations;      // how many damaged inputs the unit test makes: as many as a third of a second
                      // takes
  Seeds (*made)() = nullptr;  // its seeds, where the format changes with the program
};

// Small sound inputs: what is made worse. Where none are made, the files seed… of
// seeds/READER.tar.gz.
Seeds seeds_of(const FuzzReader& reader);
// Sound inputs of kinds that are not read: the files refused… there.
Seeds refused_seeds_of(const FuzzReader& reader);
// As libFuzzer has them in its dictionaries: a quoted word a line, \\, \" and \xAB in it.
Words words_of(const FuzzReader& reader);
// Nothing for a reader without words.
std::filesystem::path dictionary_of(const FuzzReader& reader);

// The files of a packed folder by their names; none where it is not there.
std::map<std::string, std::string> unpacked(const std::filesystem::path& archive);

// All of them, by kind of file.
const std::vector<FuzzReader>& fuzz_readers();
std::vector<FuzzReader> file_readers();
std::vector<FuzzReader> bundle_readers();
std::vector<FuzzReader> algorithm_targets();

// Throws UsageError naming those that there are.
const FuzzReader& fuzz_reader(std::string_view name);

// Whether the input was read; false: it was refused as documented, and `refusal` says how.
// Everything else that a reader may throw leaves, and is a finding: an error that says the fault
// lies in the program or in the system, or one that is not the project's own.
bool is_read(const FuzzReader& reader, std::span<const std::byte> bytes, const InputFolder& folder,
             std::string* refusal = nullptr);

// What must hold of all that is read. Its error is not one of the project's own: a finding.
inline void expect_invariant(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

inline std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}
inline std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// One of the seeds made worse by one to four changes: bits flipped, counts and lengths overwritten
// by those that programs trip over, numbers in text replaced, pieces cut out, doubled, or put in
// from other seeds, words of the format put in. The same stream gives the same bytes.
std::string damaged_seed(const Seeds& seeds, const Words& words, RandomStream& random);

}  // namespace organbake
