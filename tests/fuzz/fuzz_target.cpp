// SPDX-License-Identifier: GPL-3.0-or-later
// clang's libFuzzer on one of the project's readers (scripts/fuzz). Beside libFuzzer's own flags:
//   --reader=NAME       which of them
//   --list              their names, one a line
//   --prepare=FOLDER    writes the reader's seeds to FOLDER/seeds and its words to FOLDER/words
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string_view>

#include "fuzz/readers.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

const FuzzReader* chosen = nullptr;

std::string_view flag(int count, char** arguments, std::string_view name) {
  for (int i = 1; i < count; ++i) {
    const std::string_view argument = arguments[i];
    if (argument.starts_with(name)) return argument.substr(name.size());
  }
  return {};
}

void prepare(const FuzzReader& reader, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "seeds");
  int number = 0;
  for (const Seeds& seeds : {seeds_of(reader), refused_seeds_of(reader)})
    for (const std::string& seed : seeds)
      write_file_atomically(folder / "seeds" / ("seed" + std::to_string(number++)), seed);
  const std::filesystem::path words = dictionary_of(reader);
  write_file_atomically(folder / "words", words.empty() ? "" : read_text_file(words));
}

void start(int count, char** arguments) {
  keep_temporary_files_in_memory();
  for (int i = 1; i < count; ++i) {
    if (std::string_view(arguments[i]) != "--list") continue;
    for (const FuzzReader& reader : fuzz_readers()) std::cout << reader.name << '\n';
    std::exit(0);
  }
  chosen = &fuzz_reader(flag(count, arguments, "--reader="));
  const std::string_view folder = flag(count, arguments, "--prepare=");
  if (folder.empty()) return;
  prepare(*chosen, folder);
  std::exit(0);
}

}  // namespace
}  // namespace organbake

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  try {
    organbake::start(*count, *arguments);
  } catch (const organbake::Error& error) {
    std::cerr << "fuzz_readers: " << error.what() << '\n';
    std::exit(static_cast<int>(error.code()));
  }
  return 0;
}

// What is no documented refusal ends the program here, and libFuzzer keeps the input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::optional<organbake::InputFolder> folder(std::in_place);
  organbake::is_read(*organbake::chosen, std::as_bytes(std::span(data, size)), *folder);
  return 0;
}
