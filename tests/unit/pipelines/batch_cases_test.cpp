// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/batch_cases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/pipelines/case_table.h"

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

}  // namespace
}  // namespace organbake
