// Tests that a file is whole or absent after a write, and that a failure says which file, why, and what to
// do.
#include <csignal>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/run_directory.h"

namespace duet::io::atomic_write_test {
namespace {

// Returns the number of entries of a folder, which finds temporary files left behind.
int entries(const fs::path& folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// Returns the message of the FileError that `work` throws.
template <class Work>
std::string failure(Work work) {
  try {
    work();
  } catch (const FileError& error) {
    EXPECT_EQ(error.status(), ExitStatus::files);
    return error.what();
  }
  ADD_FAILURE() << "no FileError";
  return {};
}

TEST(AtomicWrite, ReplacesTheWholeFile) {
  const ScratchFolder scratch;
  const fs::path path = scratch / "0000.obj";
  const std::string first(100'000, 'a'), second = std::string("b\0c", 3);
  write_atomically(path, first);
  EXPECT_EQ(read_file(path), first);
  write_atomically(path, second);
  EXPECT_EQ(read_file(path), second);
  EXPECT_EQ(entries(scratch.path()), 1);
}

TEST(AtomicWrite, NamesThePathTheReasonAndARemedy) {
  const ScratchFolder scratch;
  write_atomically(scratch / "file", "x");
  const fs::path below_file = scratch / "file" / "0000.obj";
  const std::string text = failure([&] { write_atomically(below_file, "x"); });
  EXPECT_NE(text.find(below_file.string()), std::string::npos) << text;
  EXPECT_NE(text.find("Not a directory"), std::string::npos) << text;
  EXPECT_NE(text.find("choose another path"), std::string::npos) << text;
}

// Root may write everywhere except into the tables of the system, so that /proc stands for a folder without
// write permission.
TEST(AtomicWrite, FailsWhereNothingCanBeCreated) {
  failure([] { write_atomically("/proc/duet-test", "x"); });
  failure([] { create_folder("/proc/duet-test"); });
}

TEST(AtomicWrite, LeavesNothingBehindWhenTheTargetIsAFolder) {
  const ScratchFolder scratch;
  fs::create_directories(scratch / "0000.obj/inside");
  failure([&] { write_atomically(scratch / "0000.obj", "x"); });
  EXPECT_EQ(entries(scratch.path()), 1);
}

// A limit on file sizes stands for a full disk: the write fails in the middle, and the old file stays as it
// was.
TEST(AtomicWrite, KeepsTheOldFileWhenTheNewOneDoesNotFit) {
  const ScratchFolder scratch;
  const fs::path path = scratch / "0000.obj";
  write_atomically(path, "old");
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_atomically(path, std::string(5000, 'x'));
      ::_exit(1);
    } catch (const FileError& error) {
      ::_exit(std::string(error.what()).find("ulimit -f") != std::string::npos ? 0 : 2);
    }
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0);
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(entries(scratch.path()), 1);
}

// In containers all programs may have one process number, and the temporary files of a killed one stay. Names
// that are taken must not block a write.
TEST(AtomicWrite, FilesThatAKilledProgramLeftDoNotBlock) {
  const ScratchFolder scratch;
  const fs::path path = scratch / "0000.obj";
  for (int i = 0; i < 200; ++i)
    std::ofstream(fmt::format("{}{}{}-{}", path.string(), temporary_mark, ::getpid(), i)) << "left over";
  write_atomically(path, "whole");
  EXPECT_EQ(read_file(path), "whole");
  remove_temporaries(scratch.path());
  EXPECT_EQ(entries(scratch.path()), 1);
}

// A user's files stay, also those with names that resemble the program's own.
TEST(AtomicWrite, OnlyNamesThatTheProgramMakesAreTemporary) {
  const ScratchFolder scratch;
  EXPECT_TRUE(is_temporary(temporary_name(scratch / "0000.obj")));
  EXPECT_TRUE(is_temporary("mesh/0000.obj.tmp4711-0"));
  const std::vector<std::string> others = {"notes.tmpl",     "x.tmp",       "x.tmp12",    "x.tmp-1",
                                           "x.tmp12-",       "x.tmp12-3.h", ".tmp12-3",   "tmp12-3",
                                           "x.tmp12-before", "12-3",        "x.tmp1 2-3", "x.tmp12-3a"};
  for (const std::string& name : others) {
    EXPECT_FALSE(is_temporary(name)) << name;
    write_atomically(scratch / name, "the user's");
  }
  create_folder(scratch / "folder.tmp12-3/inside");
  write_atomically(scratch / "0000.obj.tmp4711-12", "left over");
  remove_temporaries(scratch.path());
  EXPECT_FALSE(fs::exists(scratch / "0000.obj.tmp4711-12"));
  EXPECT_EQ(entries(scratch.path()), static_cast<int>(others.size()) + 1) << "the folder stays as well";
}

TEST(AtomicWrite, EveryCommonReasonHasARemedy) {
  for (const int reason :
       {ENOSPC, EDQUOT, EROFS, EACCES, EPERM, EFBIG, EMFILE, ENOENT, ENOTDIR, EISDIR, EIO}) {
    const std::string text = system_error("out/mesh/0000.obj", "cannot write", reason).what();
    EXPECT_TRUE(text.starts_with("out/mesh/0000.obj: cannot write: ")) << text;
    EXPECT_EQ(text.back(), ')') << text << " has no remedy";
  }
}

// Files of /proc have the size 0, although they have content. A reader that trusts the size returns nothing.
TEST(Files, ReadsAFileWithoutASize) { EXPECT_FALSE(read_file("/proc/self/status").empty()); }

TEST(Files, ReadingAMissingFileOrAFolderFails) {
  const ScratchFolder scratch;
  EXPECT_NE(failure([&] { read_file(scratch / "none"); }).find("No such file"), std::string::npos);
  EXPECT_NE(failure([&] { read_file(scratch.path()); }).find("Is a directory"), std::string::npos);
}

TEST(Files, PipesAndDevicesAreRefusedAtOnce) {
  const ScratchFolder scratch;
  ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
  for (const fs::path& path : {scratch / "pipe", fs::path("/dev/zero")})
    EXPECT_NE(failure([&] { read_file(path); }).find("it is a pipe, a device or a socket"),
              std::string::npos);
}

TEST(Files, AFolderThatCannotBeReadIsNotAnEmptyOne) {
  const ScratchFolder scratch;
  EXPECT_TRUE(files_in(scratch / "none").empty());
  write_atomically(scratch / "file", "x");
  EXPECT_EQ(files_in(scratch.path()), std::vector<fs::path>{scratch / "file"});
  EXPECT_NE(failure([&] { files_in(scratch / "file"); }).find("cannot read the folder: Not a directory"),
            std::string::npos);
}

TEST(Files, FrameNumbersComeFromFrameFilesOnly) {
  EXPECT_EQ(frame_of_file("mesh/0012.obj", ".obj"), 12);
  EXPECT_EQ(frame_of_file("mesh/12345.obj", ".obj"), 12345);
  for (const char* name :
       {"12.obj", "0012.obj.tmp1", "0012.png", "-012.obj", "0x12.obj", "notes.obj", ".obj"})
    EXPECT_EQ(frame_of_file(name, ".obj"), -1) << name;
}

}  // namespace
}  // namespace duet::io::atomic_write_test
