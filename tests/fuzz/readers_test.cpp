// SPDX-License-Identifier: GPL-3.0-or-later
// Every reader over sound inputs, over the same cut off and made worse, and over what once broke
// it. What clang's libFuzzer does for hours (scripts/fuzz), in seconds and with any compiler.
#include "fuzz/readers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <ostream>

#include "fuzz/heap_meter.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "support/places.h"

namespace organbake {

// For the names of tests that failed.
void PrintTo(const FuzzReader& reader, std::ostream* out) { *out << reader.name; }

namespace {

namespace fs = std::filesystem;

// What a refused file may cost: a header is not believed before the file's size bears it out.
std::size_t most_bytes_for(std::size_t file_bytes) {
  constexpr std::size_t kAnyFile = 64u << 20, kPerByte = 12;
  return std::max(kAnyFile, kPerByte * file_bytes);
}

class Readers : public ::testing::TestWithParam<FuzzReader> {
 protected:
  // False: refused as documented, and cheaply.
  bool reads(const std::string& input, const std::string& what) {
    const HeapMeter meter;
    try {
      refusal_.clear();
      if (is_read(GetParam(), bytes_of(input), folder_, &refusal_)) return true;
      EXPECT_LE(meter.most_bytes(), most_bytes_for(input.size())) << what << ": " << refusal_;
    } catch (const std::exception& error) {
      ADD_FAILURE() << GetParam().name << ", " << what << ": " << error.what() << "; its input is "
                    << kept(input);
    }
    return false;
  }

  // Where a finding is left for whoever mends it.
  static std::string kept(const std::string& input) {
    const fs::path file =
        fs::path(::testing::TempDir()) / (std::string("found-") + GetParam().name);
    write_file_atomically(file, input);
    return file.string();
  }

  InputFolder folder_;
  std::string refusal_;
};

// Else everything below would be refused at the door.
TEST_P(Readers, ReadTheirSeeds) {
  const Seeds seeds = seeds_of(GetParam());
  ASSERT_FALSE(seeds.empty());
  for (std::size_t i = 0; i < seeds.size(); ++i)
    EXPECT_TRUE(reads(seeds[i], "seed " + std::to_string(i))) << "seed " << i << ": " << refusal_;
}

TEST_P(Readers, RefuseWhatTheyDoNotRead) {
  const Seeds seeds = refused_seeds_of(GetParam());
  if (seeds.empty()) GTEST_SKIP() << "it reads every kind that its format has";
  for (std::size_t i = 0; i < seeds.size(); ++i)
    EXPECT_FALSE(reads(seeds[i], "seed " + std::to_string(i))) << "seed " << i << " was read";
}

TEST_P(Readers, TakeOrRefuseWhatWasCutOff) {
  // Fewer where each takes long.
  const std::size_t cuts = std::min<std::size_t>(40, GetParam().mutations);
  for (const std::string& seed : seeds_of(GetParam())) {
    for (std::size_t i = 0; i < cuts; ++i) {
      const std::size_t length = seed.size() * i / cuts;
      reads(seed.substr(0, length), "cut to " + std::to_string(length));
    }
    for (std::size_t missing = 1; missing < std::min<std::size_t>({seed.size(), 10, cuts});
         ++missing)
      reads(seed.substr(0, seed.size() - missing), std::to_string(missing) + " bytes missing");
  }
}

TEST_P(Readers, TakeOrRefuseWhatWasDamaged) {
  const Seeds seeds = seeds_of(GetParam());
  const Words words = words_of(GetParam());
  for (int i = 0; i < GetParam().mutations; ++i) {
    RandomStream random(36, static_cast<std::uint64_t>(i));
    reads(damaged_seed(seeds, words, random), "mutation " + std::to_string(i));
  }
}

TEST_P(Readers, TakeOrRefuseWhatOnceBrokeThem) {
  const fs::path found = in_clone("tests/fuzz/findings") / GetParam().name;
  if (!fs::exists(found)) GTEST_SKIP() << "nothing was found in this reader";
  for (const fs::path& file : list_files(found)) reads(read_text_file(found / file), file.string());
}

// What libFuzzer found on ways that the seeds do not go (scripts/fuzz --keep).
TEST_P(Readers, TakeOrRefuseWhatWasKept) {
  const fs::path archive =
      in_clone("tests/fuzz/corpus") / (std::string(GetParam().name) + ".tar.gz");
  if (!fs::exists(archive)) GTEST_SKIP() << "nothing was kept for this reader";
  const auto inputs = unpacked(archive);
  EXPECT_FALSE(inputs.empty());
  for (const auto& [name, input] : inputs) reads(input, name);
}

std::string test_name(const ::testing::TestParamInfo<FuzzReader>& info) {
  std::string name = info.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Any, Readers, ::testing::ValuesIn(fuzz_readers()), test_name);

TEST(FuzzReaders, HaveNamesOfTheirOwn) {
  std::vector<std::string> names;
  for (const FuzzReader& reader : fuzz_readers()) names.emplace_back(reader.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_THROW(fuzz_reader("fax"), UsageError);
}

// A finding must not pass for a refusal.
TEST(FuzzReaders, LetOnlyDocumentedRefusalsPass) {
  const InputFolder folder;
  const auto reader_that = [](auto read) { return FuzzReader{"test", read, "", 0}; };
  const auto refuses = reader_that([](auto, const InputFolder&) { throw BadDataError("bad"); });
  EXPECT_FALSE(is_read(refuses, {}, folder));
  const auto breaks = reader_that([](auto, const InputFolder&) { throw std::bad_alloc(); });
  EXPECT_THROW(is_read(breaks, {}, folder), std::bad_alloc);
  const auto blames_itself =
      reader_that([](auto, const InputFolder&) { throw Error(ExitCode::internal, "a defect"); });
  EXPECT_THROW(is_read(blames_itself, {}, folder), Error);
}

#if !defined(__SANITIZE_ADDRESS__)
TEST(HeapMeter, CountsWhatLibrariesTake) {
  const HeapMeter meter;
  { const std::vector<char> block(10'000'000); }
  EXPECT_GE(meter.most_bytes(), 10'000'000u);
  EXPECT_LT(meter.most_bytes(), 11'000'000u);
  const HeapMeter later;
  EXPECT_LT(later.most_bytes(), 1'000'000u);
}
#endif

}  // namespace
}  // namespace organbake

int main(int count, char** arguments) {
  organbake::keep_temporary_files_in_memory();
  ::testing::InitGoogleTest(&count, arguments);
  return RUN_ALL_TESTS();
}
