// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/byte_stream.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

class ByteStreams : public ::testing::Test {
 protected:
  std::string read(ByteStream& stream, std::size_t count) {
    std::string text(count, '\0');
    text.resize(stream.read(std::as_writable_bytes(std::span(text))));
    return text;
  }
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "bytes";
};

TEST_F(ByteStreams, ReadFromAnOffsetAndToTheEnd) {
  write_bytes(file_, "0123456789");
  ByteStream stream(file_, ByteStream::Coding::raw, 3);
  EXPECT_EQ(stream.most_possible_bytes(), 7u);
  EXPECT_EQ(read(stream, 2), "34");
  stream.skip(2);
  EXPECT_EQ(read(stream, 100), "789");
  EXPECT_EQ(read(stream, 1), "");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { stream.skip(1); }), HasSubstr("truncated"));
}

TEST_F(ByteStreams, GzipMembersFollowOneAnother) {
  std::string large(1000000, 'x');
  large[999999] = 'y';
  write_bytes(file_, gzipped("one,") + gzipped(large) + std::string(5, '\0'));
  ByteStream stream(file_, ByteStream::Coding::deflate);
  EXPECT_EQ(read(stream, 4), "one,");
  EXPECT_EQ(read(stream, 2000000), large);
}

TEST_F(ByteStreams, MissingFilesAndFoldersAreNoInput) {
  message_of(ExitCode::no_input, [&] { ByteStream stream(folder_.path() / "gone"); });
  message_of(ExitCode::no_input, [&] { ByteStream stream(folder_.path()); });
}

TEST_F(ByteStreams, OtherBytesAreNoCompressedData) {
  write_bytes(file_, "neither gzip nor bzip2");
  for (const auto coding : {ByteStream::Coding::deflate, ByteStream::Coding::bzip2}) {
    ByteStream stream(file_, coding);
    EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(stream, 1); }), HasSubstr("damaged"));
  }
}

}  // namespace
}  // namespace organbake
