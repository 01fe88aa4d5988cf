// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/readers.h"

#include "organbake/core/error.h"

namespace organbake {
namespace {

std::vector<FuzzReader> all_readers() {
  std::vector<FuzzReader> all;
  for (const auto& some :
       {volume_readers(), dicom_readers(), surface_readers(), picture_readers(), document_readers(),
        camera_readers(), bundle_readers(), play_readers(), algorithm_targets()})
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

}  // namespace organbake
