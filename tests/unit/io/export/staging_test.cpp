// Tests that no exported file or folder has its name before it is whole.
#include "sim/io/export/staging.h"

#include <csignal>

#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::io::staging_test {
namespace {

using test::contains;

int entries(const fs::path& folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// Returns the message of the Error that `work` throws, and checks its status.
template <class Work>
std::string failure(ExitStatus status, Work work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), status) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no Error";
  return {};
}

TEST(Staging, FoldersAndFilesAppearWhenTheyAreFinished) {
  const ScratchFolder scratch;
  const fs::path folder = scratch / "below/more/export", file = scratch / "below/run.glb";
  {
    Staging staging(folder, Staging::Kind::folder, Staging::OldTarget::is_kept);
    EXPECT_FALSE(fs::exists(folder));
    write_atomically(staging.path() / "0000.obj", "x");
    staging.finish();
  }
  EXPECT_EQ(read_file(folder / "0000.obj"), "x");
  {
    Staging staging(file, Staging::Kind::file, Staging::OldTarget::is_kept);
    write_atomically(staging.path(), "y");
    EXPECT_FALSE(fs::exists(file));
    staging.finish();
  }
  EXPECT_EQ(read_file(file), "y");
  EXPECT_EQ(entries(scratch / "below"), 2);
}

TEST(Staging, LeavesNothingWhenItIsNotFinished) {
  const ScratchFolder scratch;
  {
    const Staging folder(scratch / "folder", Staging::Kind::folder, Staging::OldTarget::is_kept),
        file(scratch / "file", Staging::Kind::file, Staging::OldTarget::is_kept);
    write_atomically(folder.path() / "0000.obj", "x");
    write_atomically(file.path(), "x");
    EXPECT_EQ(entries(scratch.path()), 2);
  }
  EXPECT_EQ(entries(scratch.path()), 0);
}

TEST(Staging, ReplacesWhatIsThereOnlyIfAsked) {
  const ScratchFolder scratch;
  create_folder(scratch / "export");
  write_atomically(scratch / "export/old.obj", "old");
  const std::string text = failure(ExitStatus::usage, [&] {
    Staging(scratch / "export", Staging::Kind::folder, Staging::OldTarget::is_kept);
  });
  EXPECT_TRUE(contains(text, "--overwrite")) << text;
  EXPECT_TRUE(contains(
      failure(ExitStatus::usage,
              [&] { Staging(scratch / "export/", Staging::Kind::folder, Staging::OldTarget::is_kept); }),
      "is there already"))
      << "a slash at its end changes nothing";
  { const Staging given_up(scratch / "export", Staging::Kind::folder, Staging::OldTarget::is_replaced); }
  EXPECT_EQ(read_file(scratch / "export/old.obj"), "old");
  Staging staging(scratch / "export", Staging::Kind::folder, Staging::OldTarget::is_replaced);
  write_atomically(staging.path() / "new.obj", "new");
  EXPECT_EQ(read_file(scratch / "export/old.obj"), "old") << "until it is finished";
  staging.finish();
  EXPECT_EQ(read_file(scratch / "export/new.obj"), "new");
  EXPECT_FALSE(fs::exists(scratch / "export/old.obj"));
  EXPECT_EQ(entries(scratch.path()), 1);
}

// Starts an export to a target, in a process of its own that is killed while it writes.
void leave_half(const fs::path& target, Staging::Kind kind) {
  const pid_t process = ::fork();
  if (process == 0) {
    const Staging staging(target, kind, Staging::OldTarget::is_kept);
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(process, nullptr, 0);
}

TEST(Staging, RemovesWhatKilledProgramsLeft) {
  const ScratchFolder scratch;
  leave_half(scratch / "export", Staging::Kind::folder);
  leave_half(scratch / "run.glb", Staging::Kind::file);
  EXPECT_EQ(entries(scratch.path()), 2);
  for (const char* name : {"export.tmp", "other.tmp4242", "export.tmp4242-before"})
    create_folder(scratch / name);
  {
    const Staging folder(scratch / "export", Staging::Kind::folder, Staging::OldTarget::is_kept),
        file(scratch / "run.glb", Staging::Kind::file, Staging::OldTarget::is_kept);
    EXPECT_EQ(entries(scratch.path()), 5) << "the other names, and these two";
  }
  EXPECT_EQ(entries(scratch.path()), 3);
}

TEST(Staging, KeepsWhatOtherProgramsStillWrite) {
  const ScratchFolder scratch;
  const fs::path target = scratch / "export";
  const pid_t process = ::fork();
  if (process == 0) {
    const Staging staging(target, Staging::Kind::folder, Staging::OldTarget::is_kept);
    while (true) ::pause();
  }
  for (int i = 0; i < 1000 && entries(scratch.path()) == 0; ++i) ::usleep(10'000);
  {
    const Staging second(target, Staging::Kind::folder, Staging::OldTarget::is_kept);
    EXPECT_EQ(entries(scratch.path()), 2);
  }
  EXPECT_EQ(entries(scratch.path()), 1);
  ::kill(process, SIGKILL);
  ::waitpid(process, nullptr, 0);
}

// The folder is shared by machines, and a program on another one may still write: nothing here tells.
TEST(Staging, KeepsWhatOtherMachinesLeft) {
  const ScratchFolder scratch;
  leave_half(scratch / "export", Staging::Kind::folder);
  const fs::path left = files_in(scratch.path()).at(0);
  std::string name = left.filename().string();  // another machine may have the same numbers of processes
  char& digit = name.at(name.find(temporary_mark) + std::string(temporary_mark).size());
  digit = digit == 'a' ? 'b' : 'a';
  fs::rename(left, scratch / name);
  { const Staging staging(scratch / "export", Staging::Kind::folder, Staging::OldTarget::is_kept); }
  EXPECT_TRUE(fs::exists(scratch / name));
}

TEST(Staging, RefusesAFileForAFolderAndTheOtherWayRound) {
  const ScratchFolder scratch;
  write_atomically(scratch / "file", "x");
  create_folder(scratch / "folder");
  EXPECT_TRUE(contains(
      failure(ExitStatus::usage,
              [&] { Staging(scratch / "file", Staging::Kind::folder, Staging::OldTarget::is_replaced); }),
      "writes a folder, and there is a file"));
  EXPECT_TRUE(contains(
      failure(ExitStatus::usage,
              [&] { Staging(scratch / "folder", Staging::Kind::file, Staging::OldTarget::is_replaced); }),
      "writes a file, and there is a folder"));
  failure(ExitStatus::files,
          [&] { Staging(scratch / "file" / "below", Staging::Kind::folder, Staging::OldTarget::is_kept); });
  failure(ExitStatus::files,
          [&] { Staging("/proc/duet-test", Staging::Kind::folder, Staging::OldTarget::is_kept); });
  EXPECT_EQ(entries(scratch.path()), 2);
}

TEST(OutputFile, WritesPiecesOfAnySizeAndCountsThem) {
  const ScratchFolder scratch;
  std::string expected;
  OutputFile file(scratch / "file");
  for (const std::size_t size : {0, 1, 1'000'000, 3'000'000, 48'575, 1, 77}) {
    const std::string piece(size, static_cast<char>('a' + expected.size() % 7));
    file.write(piece);
    expected += piece;
    EXPECT_EQ(file.size(), expected.size());
  }
  file.write_values(std::vector<std::uint32_t>{0x64636261, 0x68676665});
  file.close();
  EXPECT_EQ(read_file(scratch / "file"), expected + "abcdefgh");
  OutputFile more(scratch / "file", OutputFile::Open::to_append);
  more.write("more");
  more.close();
  EXPECT_EQ(read_file(scratch / "file"), expected + "abcdefghmore");
  OutputFile anew(scratch / "file");
  anew.close();
  EXPECT_EQ(read_file(scratch / "file"), "");
}

TEST(OutputFile, SaysThatADiskIsFull) {
  const auto fill = [](const fs::path& path) {
    OutputFile file(path);
    for (int i = 0; i < 40; ++i) file.write(std::string(100'000, 'x'));
    file.close();
  };
  EXPECT_TRUE(contains(failure(ExitStatus::files, [&] { fill("/dev/full"); }), "No space left on device"));
  EXPECT_TRUE(contains(failure(ExitStatus::files,
                               [] {
                                 OutputFile file("/dev/full");
                                 file.write("little");
                                 file.close();
                               }),
                       "No space left on device"))
      << "also of what fits into its memory";
  const ScratchFolder scratch;
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{2'500'000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  const std::string text = failure(ExitStatus::files, [&] { fill(scratch / "large"); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_TRUE(contains(text, "File too large")) << text;
  failure(ExitStatus::files, [&] { OutputFile(scratch / "nowhere" / "file"); });
}

}  // namespace
}  // namespace duet::io::staging_test
