// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/runner.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <atomic>
#include <optional>
#include <thread>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/pipelines/cache.h"
#include "support/error_message.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class OutputTarget : public testing::Test {
 protected:
  fs::path path() const { return folder_.path(); }
  void expect_refused(const fs::path& folder) {
    message_of(ExitCode::cannot_write, [&] { check_output_folder(folder); });
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
  expect_refused("/proc/organ");  // what root may write, and nobody can
  if (::geteuid() == 0) return;
  fs::create_directory(path() / "locked");
  fs::permissions(path() / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  expect_refused(path() / "locked" / "out");
}

class OutputLock : public testing::Test {
 protected:
  LockOptions options(int patience_ms) const {
    LockOptions lock = output_lock(folder_.path() / "deep" / "organ");
    lock.patience = std::chrono::milliseconds(patience_ms);
    return lock;
  }
  TemporaryFolder folder_;
};

TEST_F(OutputLock, LeavesNothingBehind) {
  { const FileLock lock(options(0)); }
  EXPECT_TRUE(list_files(folder_.path()).empty());
}

TEST_F(OutputLock, OfTwoTheSecondWaitsOrSaysBusy) {
  std::optional<FileLock> first(std::in_place, options(0));
  const std::string told =
      message_of(ExitCode::try_again, [&] { const FileLock second(options(1)); });
  EXPECT_NE(told.find("is busy"), std::string::npos);
  std::atomic<bool> held = true;
  std::thread waiting([&] {
    const FileLock second(options(60'000));
    EXPECT_FALSE(held) << "it came before the first was done";
  });
  held = false;
  first.reset();
  waiting.join();
  EXPECT_TRUE(list_files(folder_.path()).empty());
}

// Each adds one to what it read; without the lock some additions are lost.
TEST_F(OutputLock, ManyComeOneAfterTheOther) {
  int sum = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const FileLock lock(options(60'000));
      const int read = sum;
      std::this_thread::yield();
      sum = read + 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sum, 8);
}

TEST_F(OutputLock, WhereItsFileCannotBeMadeAllGoOn) {
  LockOptions lock = options(0);
  lock.file = folder_.path() / "no" / "such" / "folder" / ".organ.lock";
  EXPECT_NO_THROW(FileLock{lock});
  lock.inherited = true;  // a batch's stays, so it must be there
  EXPECT_THROW(FileLock{lock}, Error);
}

TEST_F(OutputLock, ASlashAtTheEndNamesTheSamePlace) {
  EXPECT_EQ(output_lock(folder_.path() / "organ").file,
            output_lock(folder_.path() / "organ/").file);
}

}  // namespace
}  // namespace organbake
