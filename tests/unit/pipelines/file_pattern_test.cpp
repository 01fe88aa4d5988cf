// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/file_pattern.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

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

}  // namespace
}  // namespace organbake
