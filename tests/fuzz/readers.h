// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Every reader of the project behind one door, the inputs that it is given, and how these are
// damaged.

#include <cstddef>
#include <filesystem>
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
using Words = std::vector<std::string_view>;

inline void append(const Seeds& more, Seeds& seeds) {
  seeds.insert(seeds.end(), more.begin(), more.end());
}

// One reader of the project as a user's file reaches it: any bytes at all are read, or refused with
// one of the project's own errors (core/error.h). So are, by the algorithms, the meshes and options
// that any bytes stand for (Drawn).
struct FuzzReader {
  const char* name;
  void (*read)(std::span<const std::byte> bytes, const InputFolder& folder);
  Seeds (*seeds)();  // small sound inputs: what is made worse
  Words words;       // of the format, for what puts inputs together
  int mutations;     // how many damaged inputs the unit test makes: as many as a third of a second
                     // takes
  Seeds (*refused)() = nullptr;  // sound inputs of kinds that are not read
};

// All of them, by kind of file.
const std::vector<FuzzReader>& fuzz_readers();
std::vector<FuzzReader> volume_readers();
std::vector<FuzzReader> dicom_readers();
std::vector<FuzzReader> surface_readers();
std::vector<FuzzReader> picture_readers();
std::vector<FuzzReader> document_readers();
std::vector<FuzzReader> camera_readers();
std::vector<FuzzReader> bundle_readers();
std::vector<FuzzReader> play_readers();
std::vector<FuzzReader> algorithm_targets();

// The files of a bundle of two cameras, as parts of one input (InputFolder::parts). Its manifest is
// made anew each time: who changes a file on purpose seals it as well.
extern const std::vector<std::string> kBundleFiles;
Seeds bundle_seeds();

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
