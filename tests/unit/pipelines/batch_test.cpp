// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/batch_run.h"

#include <cstdio>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

class BatchCasesTest : public testing::Test {
 protected:
  void add_file(const std::string& name) {
    fs::create_directories((folder_.path() / name).parent_path());
    write_file_atomically(folder_.path() / name, std::string_view("x"));
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::vector<std::string> names(const std::vector<std::string>& words) const {
    std::vector<std::string> found;
    for (const BatchCase& one : cases_of_words(words, "ct")) found.push_back(one.name);
    return found;
  }
  TemporaryFolder folder_;
};

TEST_F(BatchCasesTest, FilesAreCalledWithoutTheirEndingFoldersInFull) {
  fs::create_directory(path("1.2.840.1"));
  add_file("scan.7.nii.gz");
  EXPECT_THAT(names({path("1.2.840.1") + "/", path("scan.7.nii.gz")}),
              ElementsAre("1.2.840.1", "scan.7"));
}

TEST_F(BatchCasesTest, MatchesAreCalledAfterTheirPathBelowThePattern) {
  add_file("2021/july/clip.mha");
  add_file("2022/clip.mha");
  EXPECT_THAT(names({path("**/*.mha")}), ElementsAre("2021_july_clip", "2022_clip"));
}

TEST_F(BatchCasesTest, NamesThatCantBeFoldersOrMeetAreRefused) {
  EXPECT_THROW(names({"a/scan.mha", "b/scan.mha"}), UsageError);
  for (const char* word : {"..", "-rf.mha", "a\nb.mha", "logs", "pictures"}) {
    EXPECT_THROW(names({word}), UsageError) << word;
  }
  EXPECT_THROW(cases_of_words({"a.mha"}, "surfaces"), UsageError);
}

TEST_F(BatchCasesTest, ATableIsReadAsItWasWritten) {
  const std::vector<BatchCase> cases = {{"one", {"ct=/a, \"b\" c.mha", "label=5"}},
                                        {"two, \"2\"", {"decimate.faces=80"}}};
  write_file_atomically(folder_.path() / "t.csv", case_table_text(cases));
  const std::vector<BatchCase> read = read_case_table(folder_.path() / "t.csv");
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].name, "one");
  EXPECT_THAT(read[0].settings, ElementsAre("ct=/a, \"b\" c.mha", "label=5"));
  EXPECT_EQ(read[1].name, "two, \"2\"");
  EXPECT_THAT(read[1].settings, ElementsAre("decimate.faces=80"));
}

// The same two cases in each of them; the second's name and path hold what separates fields.
TEST_F(BatchCasesTest, ATableIsReadAsSpreadsheetsSaveIt) {
  const std::string utf16 = [] {
    std::string bytes = "\xFF\xFE";
    for (const char c : std::string("case\tct\tlabel\r\none\t/a.mha\t5\r\nt;w,o\t/b;c,d.mha\t\r\n"))
      bytes += {c, '\0'};
    return bytes;
  }();
  const std::string tables[] = {
      "\xEF\xBB\xBF"
      "case,ct,label\r\none,/a.mha,5\r\n\"t;w,o\",\"/b;c,d.mha\",\r\n",
      "case;ct;label\none;/a.mha;5\n\"t;w,o\";\"/b;c,d.mha\";\n",
      "sep=;\r\ncase;ct;label\r\none;/a.mha;5\r\n\"t;w,o\";\"/b;c,d.mha\";\r\n",
      "case\tct\tlabel\none\t/a.mha\t5\nt;w,o\t/b;c,d.mha\t\n",
      "case,ct,label\rone,/a.mha,5\r\"t;w,o\",\"/b;c,d.mha\",\r",
      "case, ct ,label,,\none,/a.mha,5,,\n\"t;w,o\",\"/b;c,d.mha\",,,\n,,,,\n,,,,\n",
      utf16};
  for (const std::string& table : tables) {
    SCOPED_TRACE(table);
    write_file_atomically(folder_.path() / "t.csv", table);
    const std::vector<BatchCase> read = read_case_table(folder_.path() / "t.csv");
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[0].name, "one");
    EXPECT_THAT(read[0].settings, ElementsAre("ct=/a.mha", "label=5"));
    EXPECT_EQ(read[1].name, "t;w,o");
    EXPECT_THAT(read[1].settings, ElementsAre("ct=/b;c,d.mha"));
  }
}

TEST_F(BatchCasesTest, AValueWithoutAColumnsNameIsRefused) {
  write_file_atomically(folder_.path() / "t.csv", std::string_view("case,ct,\none,/a.mha,lost\n"));
  EXPECT_THROW(read_case_table(folder_.path() / "t.csv"), BadDataError);
}

TEST_F(BatchCasesTest, TablesHaveSeveralEndingsAndWorkbooksAreRefused) {
  for (const char* name : {"t.csv", "t.tsv", "t.txt", "T.CSV"}) {
    write_file_atomically(folder_.path() / name, std::string_view("case\tlabel\none\t5\n"));
    EXPECT_THAT(names({path(name)}), ElementsAre("one")) << name;
  }
  EXPECT_THROW(names({"cases.xlsx"}), UsageError);
}

TEST_F(BatchCasesTest, ALineBreakIsNoField) {
  EXPECT_THROW(case_table_text({{"one", {"ct=a\nb"}}}), UsageError);
}

TEST(Shards, TakeEveryNthCase) {
  std::vector<BatchCase> cases;
  for (const char* name : {"a", "b", "c", "d", "e"}) cases.push_back({name, {}});
  const auto mine = cases_of_shard(cases, parse_shard("2/3"));
  ASSERT_EQ(mine.size(), 2U);
  EXPECT_EQ(mine[0].name, "b");
  EXPECT_EQ(mine[1].name, "e");
  for (const char* text : {"0/3", "4/3", "1", "1/0", "1/3x", "-1/3"}) {
    EXPECT_THROW(parse_shard(text), UsageError) << text;
  }
}

class FilePatternTest : public testing::Test {
 protected:
  FilePatternTest() {
    for (const char* name : {"b.mp4", "a.mp4", ".hidden.mp4", "notes.txt", "x/c.mp4", "x/y/d.mp4",
                             ".git/e.mp4", "odd [1]/f.mp4"}) {
      fs::create_directories((folder_.path() / name).parent_path());
      write_file_atomically(folder_.path() / name, std::string_view("x"));
    }
  }
  std::vector<std::string> names(const std::string& pattern) const {
    std::vector<std::string> found;
    for (const fs::path& file : files_matching((folder_.path() / pattern).string())) {
      found.push_back(file.lexically_relative(folder_.path()).string());
    }
    return found;
  }
  TemporaryFolder folder_;
};

TEST_F(FilePatternTest, AStarStaysInOneFolderAndLeavesHiddenFilesOut) {
  EXPECT_THAT(names("*.mp4"), ElementsAre("a.mp4", "b.mp4"));
  EXPECT_THAT(names("*/?.mp4"), ElementsAre("odd [1]/f.mp4", "x/c.mp4"));
  EXPECT_THAT(names("[b-z].mp4"), ElementsAre("b.mp4"));
}

TEST_F(FilePatternTest, TwoStarsAreAnyNumberOfFolders) {
  EXPECT_THAT(names("**/*.mp4"),
              ElementsAre("a.mp4", "b.mp4", "odd [1]/f.mp4", "x/c.mp4", "x/y/d.mp4"));
  EXPECT_THAT(names("x/**"), ElementsAre("x/c.mp4", "x/y/d.mp4"));
}

TEST_F(FilePatternTest, ALinkInACircleEnds) {
  fs::create_directory_symlink(folder_.path(), folder_.path() / "x" / "round");
  EXPECT_EQ(names("**/*.mp4").size(), 5U);
}

TEST_F(FilePatternTest, AFileThatIsReallyCalledSoIsNoPattern) {
  EXPECT_FALSE(is_file_pattern((folder_.path() / "odd [1]").string()));
  EXPECT_TRUE(is_file_pattern((folder_.path() / "*.mp4").string()));
  EXPECT_FALSE(is_file_pattern("plain.mp4"));
}

TEST_F(FilePatternTest, NothingFoundIsAnError) {
  EXPECT_THROW(names("*.avi"), NoInputError);
  EXPECT_THROW(names("none/*.mp4"), NoInputError);
}

TEST(FolderOfPattern, IsWhatComesBeforeTheFirstWildcard) {
  EXPECT_EQ(folder_of_pattern("a/b/*/c.mp4"), "a/b");
  EXPECT_EQ(folder_of_pattern("/a/**"), "/a");
  EXPECT_EQ(folder_of_pattern("*.mp4"), ".");
}

using testing::HasSubstr;

class CaseEstimateTest : public testing::Test {
 protected:
  fs::path file(const std::string& name, std::string_view text, std::uintmax_t bytes = 0) {
    write_file_atomically(folder_.path() / name, text);
    if (bytes > 0) fs::resize_file(folder_.path() / name, bytes);
    return folder_.path() / name;
  }
  CaseEstimate estimate(const std::vector<std::string>& settings) {
    return estimate_case(file("r.yaml", "schema: organbake/recipe/1\nname: r\n"), settings);
  }
  TemporaryFolder folder_;
};

TEST_F(CaseEstimateTest, HeadersTellTheVoxels) {
  EXPECT_EQ(voxels_in(file("a.mha", "ObjectType = Image\nDimSize = 57 78 64\n")), 57 * 78 * 64);
  EXPECT_EQ(voxels_in(file("a.nrrd", "NRRD0004\nsizes: 10 20 30\n")), 6000);
  EXPECT_EQ(voxels_in(file("a.nii", "x", 2000)), 1000);
  EXPECT_EQ(voxels_in(file("a.nii.gz", std::string_view("packed\x00\x00\x10\x00", 10))), 1 << 19);
  EXPECT_THROW(voxels_in("none.mha"), NoInputError);
}

TEST_F(CaseEstimateTest, DamagedHeadersAreNoReasonToFail) {
  EXPECT_EQ(voxels_in(file("a.mha", "DimSize = many\n")), 7.5);
  EXPECT_EQ(voxels_in(file("a.nii.gz", "xy")), 1);
}

TEST_F(CaseEstimateTest, ABiggerInputNeedsMore) {
  const fs::path small = file("s.nii", "x", 1'000'000), big = file("b.nii", "x", 1'000'000'000);
  const CaseEstimate less = estimate({"ct=" + small.string()});
  const CaseEstimate more = estimate({"ct=" + big.string()});
  EXPECT_EQ(less.flaw, "");
  EXPECT_GT(less.cpu_seconds, 0);
  EXPECT_GT(more.cpu_seconds, less.cpu_seconds);
  EXPECT_GT(more.memory_mb, 1000);  // two bytes a voxel are read, at the least
  EXPECT_LT(less.memory_mb, 1000);
}

TEST_F(CaseEstimateTest, FewerFramesAndSmallerMapsNeedLess) {
  const std::string clip = "frames=" + file("c.mp4", "x", 50'000'000).string();
  const CaseEstimate all = estimate({clip});
  EXPECT_LT(estimate({clip, "shade.every=25"}).cpu_seconds, all.cpu_seconds);
  EXPECT_LT(estimate({clip, "place.size_px=64"}).memory_mb,
            estimate({clip, "place.size_px=4096"}).memory_mb);
}

TEST_F(CaseEstimateTest, SaysWhyNothingCanBeTold) {
  EXPECT_THAT(estimate({"ct=/none.mha"}).flaw, HasSubstr("/none.mha"));
  EXPECT_THAT(estimate({"ct=/none.mha", "decimate.facez=3"}).flaw, HasSubstr("facez"));
  EXPECT_THAT(estimate({}).flaw, HasSubstr("lacks its input"));
}

using testing::StartsWith;

// What a shell makes of a word.
std::string as_shell_reads(const std::string& word) {
  FILE* shell = ::popen(("printf %s " + word).c_str(), "r");
  std::string text;
  for (int c = 0; (c = std::fgetc(shell)) != EOF;) text += static_cast<char>(c);
  EXPECT_EQ(::pclose(shell), 0) << word;
  return text;
}

TEST(ShellWord, IsReadAsItWas) {
  for (const char* text : {"plain/path-1.2_3", "two words", "it's", "\"$HOME\" `id` $(id)", "*?[a]",
                           "a;b|c&d<e>f", "ümlaut", "\\n\\", "~", "#", "", "!x", "{a,b}", "a=b"}) {
    EXPECT_EQ(as_shell_reads(shell_word(text)), text);
  }
}

TEST(ShellWord, StaysPlainWhenItCan) { EXPECT_EQ(shell_word("/a/b-1.csv"), "/a/b-1.csv"); }

JobPlan plan() {
  return {.program = "/opt/organ bake/organbake",
          .output = "/data/it's \"out\" {1}",
          .arguments = {"--recipe", "/r.yaml", "--set", "label=5"},
          .tasks = 3,
          .threads = 2,
          .memory_mb = 1499.5,
          .minutes = 12.1};
}

TEST(JobArray, AsksForWhatIsNeededBeforeItsFirstCommand) {
  const std::string script = job_array(plan());
  EXPECT_THAT(script, StartsWith("#!/bin/bash\n"));
  const std::size_t first_command = script.find("\nprogram=");
  for (const char* line : {"#SBATCH --array=1-3\n", "#SBATCH --mem=1500M\n", "#SBATCH --time=13\n",
                           "#SBATCH --cpus-per-task=2\n", "#SBATCH --requeue\n"}) {
    EXPECT_LT(script.find(line), first_command) << line;
  }
}

TEST(JobSnakefile, RefusesWhatIsNoUtf8) {
  JobPlan odd = plan();
  odd.output = "/data/\xff";
  EXPECT_THROW(job_snakefile(odd), UsageError);
}

}  // namespace
}  // namespace organbake
