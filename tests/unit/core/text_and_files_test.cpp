// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/text.h"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <new>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/run_context.h"
#include "organbake/core/scalar_type.h"
#include "organbake/core/sha256.h"
#include "organbake/core/temporary_files.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(ToText, ReadsBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3, 6.02e23, -5e-324, 1.7976931348623157e308, 0.0})
    EXPECT_EQ(std::strtod(to_text(value).c_str(), nullptr), value);
  EXPECT_EQ(to_text(0.1), "0.1");
}

TEST(ToText, RoundsToTheDigitsAskedFor) {
  EXPECT_EQ(to_text(12.346, 2), "12.35");
  EXPECT_EQ(to_text(-1e300, 0).size(), 302u);  // the longest there is
}

TEST(Padded, FillsUpWithZerosAndCutsNothing) {
  EXPECT_EQ(padded(7, 3), "007");
  EXPECT_EQ(padded(0, 1), "0");
  EXPECT_EQ(padded(12345, 3), "12345");
}

TEST(Trimmed, LosesTheBlanksAtBothEndsOnly) {
  EXPECT_EQ(trimmed("\t a b \r\n"), "a b");
  EXPECT_EQ(trimmed(" \n"), "");
  EXPECT_EQ(trimmed("\ta ", " "), "\ta");
}

TEST(FirstLetter, SkipsBlanksAndIsZeroWhereNothingElseStands) {
  EXPECT_EQ(first_letter(" \n{"), '{');
  EXPECT_EQ(first_letter(" \t"), '\0');
}

TEST(EscapeHtml, LeavesNothingThatMarkupWouldRead) {
  EXPECT_EQ(escape_html("a<b & 'c' > \"d\""), "a&lt;b &amp; &#39;c&#39; &gt; &quot;d&quot;");
}

TEST(NearestName, SuggestsWhatIsClose) {
  const std::vector<std::string> names = {"faces", "method", "size"};
  EXPECT_EQ(suggestion("facs", names), "; did you mean 'faces'?");
  EXPECT_EQ(suggestion("metod", names), "; did you mean 'method'?");
  EXPECT_EQ(suggestion("siez", names), "; did you mean 'size'?");
  EXPECT_EQ(suggestion("Left-Kidny", {"spleen", "left kidney"}), "; did you mean 'left kidney'?");
}

TEST(NearestName, SuggestsTheNameWithItsUnit) {
  EXPECT_EQ(suggestion("field_of_view", {"faces", "field_of_view_deg"}),
            "; did you mean 'field_of_view_deg'?");
  EXPECT_EQ(suggestion("--stereo", {"--stereo-mm"}), "; did you mean '--stereo-mm'?");
  EXPECT_EQ(suggestion("--view", {"--video", "--view-deg"}), "; did you mean '--view-deg'?");
  EXPECT_EQ(suggestion("view", {"viewing_cone"}), "") << "another word goes on there";
}

TEST(NearestName, IsSilentAboutWhatIsFar) {
  EXPECT_EQ(suggestion("transparency", {"faces", "size"}), "");
  EXPECT_EQ(suggestion("x", {}), "");
  EXPECT_EQ(suggestion("ab", {"cd"}), "") << "two changes make any two letters equal";
}

TEST(ExitCodeFor, NamesEveryKindOfError) {
  EXPECT_EQ(exit_code_for(UsageError("x")), ExitCode::usage);
  EXPECT_EQ(exit_code_for(BadDataError("x")), ExitCode::bad_data);
  EXPECT_EQ(exit_code_for(NoInputError("f", "x")), ExitCode::no_input);
  EXPECT_EQ(exit_code_for(IoError::reading("f", "x")), ExitCode::read_error);
  EXPECT_EQ(exit_code_for(IoError::writing("f", "x")), ExitCode::cannot_write);
  EXPECT_EQ(exit_code_for(RecipeError("x")), ExitCode::bad_recipe);
  EXPECT_EQ(exit_code_for(CancelledError()), ExitCode::interrupted);
  EXPECT_EQ(exit_code_for(std::bad_alloc()), ExitCode::try_again);
  const std::filesystem::filesystem_error refused("x", std::error_code());
  EXPECT_EQ(exit_code_for(refused), ExitCode::read_error);
  EXPECT_EQ(exit_code_for(std::runtime_error("x")), ExitCode::internal);
}

TEST(MessageFor, SaysOfTheSystemsErrorsTheFileAndTheReason) {
  const std::filesystem::filesystem_error refused(
      "status", "a/b", std::make_error_code(std::errc::permission_denied));
  EXPECT_EQ(message_for(refused), "a/b: Permission denied");
  EXPECT_EQ(message_for(std::bad_alloc()), "out of memory");
  EXPECT_EQ(message_for(UsageError("x")), "x");
}

TEST(Error, PutsTheFileFirst) {
  EXPECT_STREQ(BadDataError("a/b.ply", "has no faces").what(), "a/b.ply: has no faces");
}

TEST(RunContext, IsSilentByDefaultAndThrowsOnceCancelled) {
  EXPECT_NO_THROW(RunContext().throw_if_cancelled());
  std::atomic<bool> flag{false};
  const RunContext context({}, {}, &flag);
  EXPECT_NO_THROW(context.throw_if_cancelled());
  flag = true;
  EXPECT_THROW(context.throw_if_cancelled(), CancelledError);
}

constexpr std::array kAll = {ScalarType::int8,   ScalarType::uint8,  ScalarType::int16,
                             ScalarType::uint16, ScalarType::int32,  ScalarType::uint32,
                             ScalarType::int64,  ScalarType::uint64, ScalarType::float32,
                             ScalarType::float64};

// Least and largest value tell width, signedness and kind of a C++ type.
TEST(ScalarType, IsDispatchedToTheTypeOfItsName) {
  const std::array<std::pair<double, double>, 8> limits = {{{-128, 127},
                                                            {0, 255},
                                                            {-32768, 32767},
                                                            {0, 65535},
                                                            {-2147483648.0, 2147483647.0},
                                                            {0, 4294967295.0},
                                                            {-0x1p63, 0x1p63},  // rounded
                                                            {0, 0x1p64}}};
  for (std::size_t i = 0; i < limits.size(); ++i) {
    with_scalar_type(kAll[i], [&](auto zero) {
      using Number = decltype(zero);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::lowest()), limits[i].first);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::max()), limits[i].second);
    });
    EXPECT_FALSE(is_floating_point(kAll[i]));
    EXPECT_EQ(bytes_of(kAll[i]), std::size_t{1} << i / 2);
  }
  EXPECT_TRUE(is_floating_point(ScalarType::float32));
  EXPECT_TRUE(is_floating_point(ScalarType::float64));
  EXPECT_EQ(bytes_of(ScalarType::float32), 4u);
  EXPECT_EQ(bytes_of(ScalarType::float64), 8u);
}

TEST(ScalarType, SwapsTheBytesOfEachNumber) {
  for (const ScalarType type : kAll) {
    const std::size_t width = bytes_of(type);
    std::array<std::byte, 16> bytes, expected;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::byte>(i);
      expected[i] = static_cast<std::byte>(i / width * width + (width - 1 - i % width));
    }
    swap_bytes(bytes.data(), bytes.size() / width, type);
    EXPECT_EQ(bytes, expected);
  }
}

std::string hash_of(std::string_view text) {
  return sha256_hex(std::as_bytes(std::span(text.data(), text.size())));
}

TEST(Sha256, MatchesTheStandardsExamples) {  // FIPS 180-4
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  TemporaryFolder folder_;
  fs::path at(const char* name) const { return folder_.path() / name; }
};

// In a folder of programs, beside a module, and where Debian's and the build's Python have theirs;
// a program that stands alone names where one would lie.
TEST_F(Files, ModulesLieInTheNextFolderAboveTheCode) {
  const fs::path prefix = folder_.path() / "usr", modules = prefix / "lib/organbake";
  fs::create_directories(modules);
  for (const char* code : {"bin/organbake", "lib/organbake/stage_isosurface.so",
                           "lib/python3/dist-packages/organbake.so", "python/organbake.so"})
    EXPECT_EQ(module_folder_above(prefix / code), modules) << code;
  EXPECT_EQ(module_folder_above(folder_.path() / "alone/bin/organbake"),
            folder_.path() / "alone/lib/organbake");
  EXPECT_EQ(message_of(ExitCode::internal, [] { module_door("no_such", "door"); })
                .rfind(module_folder().string() + "/no_such.so: cannot be loaded", 0),
            0U);
}

TEST_F(Files, WrittenTextIsReadBack) {
  write_file_atomically(at("a.txt"), "one\ntwo");
  EXPECT_EQ(read_text_file(at("a.txt")), "one\ntwo");
  write_file_atomically(at("a.txt"), "");
  EXPECT_EQ(read_text_file(at("a.txt")), "");
}

TEST_F(Files, ReadingNamesWhatIsWrong) {
  EXPECT_THROW(read_file(at("missing")), NoInputError);
  EXPECT_THROW(read_file(folder_.path()), NoInputError);
  write_file_atomically(at("big"), "12345");
  EXPECT_THROW(read_file(at("big"), 4), BadDataError);
  EXPECT_EQ(read_file(at("big"), 5).size(), 5u);
}

// A reader that opened one would wait for ever.
TEST_F(Files, PipesAreNotWaitedFor) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  EXPECT_THROW(read_file(at("pipe")), NoInputError);
  EXPECT_THROW(read_text_file(at("pipe")), NoInputError);
  EXPECT_THROW(read_beginning(at("pipe"), 3), NoInputError);
  EXPECT_THROW(read_file("/dev/zero"), NoInputError);
}

TEST_F(Files, OfAFolderOnlyWhatLiesInsideIsRead) {
  constexpr std::uint64_t kMost = 5;
  const auto refused = [&](const char* file) {
    EXPECT_THROW(read_file_inside(at("in"), file, kMost), BadDataError) << file;
  };
  fs::create_directories(at("in/sub"));
  fs::create_directories(at("out"));
  write_file_atomically(at("in/sub/a"), "12345");
  write_file_atomically(at("in/large"), "123456");
  write_file_atomically(at("out/a"), "12345");
  EXPECT_EQ(read_file_inside(at("in"), "sub/a", kMost).size(), 5u);
  fs::create_symlink("../out/a", at("in/link"));
  fs::create_symlink("sub/a", at("in/link_inside"));
  fs::create_directory_symlink("../out", at("in/linked"));
  ASSERT_EQ(::mkfifo(at("in/pipe").c_str(), 0600), 0);
  for (const char* file : {"missing", "sub", "large", "link", "link_inside", "linked/a", "pipe",
                           "../out/a", "sub/../../out/a", "sub/a/b"})
    refused(file);
  EXPECT_THROW(read_file_inside(at("nowhere"), "a", kMost), BadDataError);
  // The folder itself is the caller's: a link may lead to it.
  fs::create_directory_symlink("in", at("link_to_in"));
  EXPECT_EQ(read_file_inside(at("link_to_in"), "sub/a", kMost).size(), 5u);
}

TEST_F(Files, ABeginningIsNeverLongerThanItsFile) {
  write_file_atomically(at("a"), "12345");
  EXPECT_EQ(read_beginning(at("a"), 3), "123");
  EXPECT_EQ(read_beginning(at("a"), 9), "12345");
  EXPECT_THROW(read_beginning(at("missing"), 3), NoInputError);
  EXPECT_THROW(read_beginning(folder_.path(), 3), NoInputError);
}

TEST_F(Files, DevicesPipesAndFoldersAreNoFilesToWrite) {
  const fs::path pipe = at("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0666), 0);
  for (const fs::path& path : {pipe, folder_.path(), fs::path("/dev/full")})
    EXPECT_THROW(write_file_atomically(path, "x"), IoError) << path;
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(Files, ALinkStaysAndItsFileIsWritten) {
  fs::create_symlink("a.txt", at("link.txt"));
  for (const char* text : {"new", "newer"}) {  // there is no a.txt at first
    write_file_atomically(at("link.txt"), text);
    EXPECT_TRUE(fs::is_symlink(at("link.txt")));
    EXPECT_EQ(read_text_file(at("a.txt")), text);
  }
}

TEST_F(Files, AFailedWriteLeavesNothing) {
  const fs::path inside_missing = folder_.path() / "no" / "such" / "a.txt";
  EXPECT_THROW(write_file_atomically(inside_missing, "x"), IoError);
  fs::create_directory(at("taken"));
  EXPECT_THROW(write_file_atomically(at("taken"), "x"), IoError);  // a folder is in the way
  EXPECT_EQ(list_files(folder_.path()).size(), 0u);
}

TEST_F(Files, AFolderAppearsOnlyWhenCommitted) {
  {
    AtomicFolder dropped(at("out"));
    write_file_atomically(dropped.path() / "f", "half");
    EXPECT_FALSE(fs::exists(at("out")));
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  AtomicFolder kept(at("out"));
  write_file_atomically(kept.path() / "f", "whole");
  EXPECT_TRUE(kept.commit());
  EXPECT_EQ(read_text_file(at("out") / "f"), "whole");
}

TEST_F(Files, CommitReplacesOrKeepsWhatWasThere) {
  const auto commit = [&](const char* text, AtomicFolder::IfExists rule) {
    AtomicFolder out(at("out"));
    write_file_atomically(out.path() / "f", text);
    return out.commit(rule);
  };
  EXPECT_TRUE(commit("1", AtomicFolder::IfExists::replace));
  EXPECT_TRUE(commit("2", AtomicFolder::IfExists::replace));
  EXPECT_FALSE(commit("3", AtomicFolder::IfExists::keep_existing));
  EXPECT_EQ(read_text_file(at("out") / "f"), "2");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 1);
}

TEST_F(Files, WhatAKilledProcessLeftIsSwept) {
  const fs::path stale = at(".out.tmp-999999999-0");  // no such process: ids end at 2²²
  fs::create_directories(stale / "cam_000");
  AtomicFolder out(at("out"));
  EXPECT_FALSE(fs::exists(stale));
}

TEST_F(Files, WhatAKilledProcessLeftIsSweptWhereNothingIsWritten) {
  fs::create_directories(at(".out.tmp-999999999-0"));
  std::ofstream(at("out.tmp-999999999")) << "half";
  AtomicFolder::sweep(at("out") / "");
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  for (const char* name : {".a.tmp-999999999-0", ".b.tmp-999999999-7", "kept", ".c.tmp-x"})
    fs::create_directories(at(name));
  fs::create_directories(at((".d.tmp-" + std::to_string(::getpid()) + "-0").c_str()));  // alive
  AtomicFolder::sweep_inside(folder_.path());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 3);
}

TEST_F(Files, FoldersAreMadeOrTheSentenceSaysWhyNot) {
  make_folder(at("a") / "b");
  make_folder(at("a") / "b");
  EXPECT_TRUE(fs::is_directory(at("a") / "b"));
  std::ofstream(at("file")) << "x";
  EXPECT_THROW(make_folder(at("file") / "c"), IoError);
}

TEST_F(Files, WhatAKilledProcessLeftOfAFileIsSweptWhenItIsWritten) {
  const fs::path stale = at("a.txt.tmp-999999999");
  const std::vector<fs::path> others = {
      at("b.txt.tmp-999999999"), at("a.txt.tmp-x"), at("a.txt.tmp"),
      folder_.path() / ("a.txt.tmp-" + std::to_string(::getppid()))};  // alive
  std::ofstream{stale} << "half";
  for (const fs::path& other : others) std::ofstream{other} << "x";
  write_file_atomically(at("a.txt"), "whole");
  EXPECT_FALSE(fs::exists(stale));
  for (const fs::path& other : others) EXPECT_TRUE(fs::exists(other)) << other;
}

TEST_F(Files, WhatAnUnburiedProcessLeftIsSweptToo) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  siginfo_t end{};  // it has ended, but WNOWAIT leaves it a zombie
  ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &end, WEXITED | WNOWAIT), 0);
  const fs::path left = folder_.path() / (".out.tmp-" + std::to_string(child) + "-0");
  fs::create_directory(left);
  AtomicFolder out(at("out"));
  EXPECT_FALSE(fs::exists(left));
  ::waitid(P_PID, static_cast<id_t>(child), &end, WEXITED);
}

TEST_F(Files, ListsInByteOrder) {
  fs::create_directory(at("b"));
  for (const char* name : {"b/x", "a", "B"}) std::ofstream(at(name)) << "x";
  const std::vector<fs::path> expected = {"B", "a", "b/x"};
  EXPECT_EQ(list_files(folder_.path()), expected);
}

TEST_F(Files, NumberedOnesComeInTheOrderOfTheirNumbers) {
  fs::create_directory(at("masks"));
  for (const char* name : {"masks/f1.png", "f10.png", "f2.png", "f1.png"})
    std::ofstream(at(name)) << "x";
  const std::vector<fs::path> expected = {"f1.png", "f2.png", "f10.png"};
  EXPECT_EQ(list_numbered_files(folder_.path()), expected);
}

}  // namespace
}  // namespace organbake
