// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/output_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <thread>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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
  try {
    const FileLock second(options(1));
    FAIL() << "both hold it";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::try_again);
    EXPECT_NE(std::string(error.what()).find("is busy"), std::string::npos);
  }
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
