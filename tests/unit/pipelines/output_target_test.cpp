// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/output_target.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class OutputTarget : public testing::Test {
 protected:
  fs::path path() const { return folder_.path(); }
  void expect_refused(const fs::path& folder) {
    try {
      check_output_folder(folder);
      FAIL() << folder << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::cannot_write);
    }
  }
  TemporaryFolder folder_;
};

TEST_F(OutputTarget, NewAndEmptyFoldersAreFine) {
  EXPECT_NO_THROW(check_output_folder(path() / "new"));
  EXPECT_NO_THROW(check_output_folder(path() / "deep" / "new" / ""));
  fs::create_directory(path() / "empty");
  EXPECT_NO_THROW(check_output_folder(path() / "empty"));
  EXPECT_NO_THROW(check_output_folder("relative"));
  EXPECT_FALSE(fs::exists(path() / "deep")) << "checking makes nothing";
}

TEST_F(OutputTarget, AUsersFolderIsRefused) {
  write_file_atomically(path() / "thesis.tex", "years of work");
  expect_refused(path());
  write_file_atomically(path() / "manifest.json", R"({"name": "some web app"})");
  expect_refused(path());
}

TEST_F(OutputTarget, OurFoldersMayBeReplacedButNotWhatLiesBesideOurFiles) {
  fs::create_directory(path() / "a");
  write_file_atomically(path() / "a" / "b.exr", "x");
  for (const std::string version : {"1", "2"}) {
    write_file_atomically(path() / "manifest.json", R"({"schema": "organbake/bundle/)" + version +
                                                        R"(", "files": [{"path": "a/b.exr"}]})");
    EXPECT_NO_THROW(check_output_folder(path())) << version;
  }
  write_file_atomically(path() / "notes.txt", "mine");
  expect_refused(path());
}

TEST_F(OutputTarget, StageFoldersAreKnownByTheirReport) {
  write_file_atomically(path() / "report.json",
                        R"({"schema": "organbake/stage-report/1", "files": ["vpm.ply"]})");
  write_file_atomically(path() / "vpm.ply", "x");
  EXPECT_NO_THROW(check_output_folder(path()));
}

TEST_F(OutputTarget, FilesAndFoldersAreNotMixedUp) {
  write_file_atomically(path() / "file", "x");
  expect_refused(path() / "file");
  expect_refused(path() / "file" / "below");
  EXPECT_THROW(check_output_file(path(), ".ply"), IoError);
  EXPECT_NO_THROW(check_output_file(path() / "file", ".ply"));
  EXPECT_NO_THROW(check_output_file(path() / "x.ply", ".ply"));
  EXPECT_THROW(check_output_file(path() / "x.stl", ".ply"), UsageError);
}

TEST_F(OutputTarget, AnUnwritableFolderIsRefused) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::create_directory(path() / "locked");
  fs::permissions(path() / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  expect_refused(path() / "locked" / "out");
}

}  // namespace
}  // namespace organbake
