#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

#include "render/sequence.h"
#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::render::video_test {
namespace {

namespace fs = std::filesystem;

// A run with four pictures. The name of its folder would trip a shell and a file-name pattern.
class Video : public testing::Test {
 protected:
  Video() {
    fs::create_directories(run_.root / "image");
    for (int frame = 3; frame < 7; ++frame)
      write_png(run_.image(frame).string(), 33, 16,
                std::vector<unsigned char>(3 * 33 * 16, static_cast<unsigned char>(40 * frame)));
  }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(run_.root))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  const ScratchFolder scratch_;
  const io::RunDirectory run_{scratch_ / "duet video 100%d; $HOME"};
};

TEST_F(Video, IsEncodedFromTheFirstPictureOn) {
  const std::string note = encode_video(run_, "ball", 24);
  EXPECT_EQ(note, (run_.root / "ball.mp4").string());
  EXPECT_EQ(files(), (std::vector<std::string>{"ball.mp4", "image"}));
  EXPECT_GT(fs::file_size(run_.root / "ball.mp4"), 500u);
}

TEST_F(Video, AMissingProgramIsANote) {
  const std::string note = encode_video(run_, "ball", 24, (run_.root / "no-ffmpeg").string());
  EXPECT_NE(note.find("not installed (apt install ffmpeg)"), std::string::npos) << note;
  EXPECT_EQ(files(), std::vector<std::string>{"image"});
}

TEST_F(Video, AFailingProgramIsANoteWithItsWords) {
  std::ofstream(run_.image(3)) << "no picture";
  const std::string note = encode_video(run_, "ball", 24);
  EXPECT_NE(note.find("no video"), std::string::npos) << note;
  EXPECT_NE(note.find("failed with status"), std::string::npos) << note;
  EXPECT_EQ(files(), std::vector<std::string>{"image"});
}

// The next encoder removes what killed ones left of this video, and nothing else.
TEST_F(Video, ReplacesThatOfAKilledProgram) {
  for (const std::string name : {"ball.mp4", "other.mp4", "ball.mp4.txt"})
    std::ofstream(run_.root / (name + std::string(io::temporary_mark) + "4000000-1")) << "half a video";
  encode_video(run_, "ball", 24);
  EXPECT_EQ(files(), (std::vector<std::string>{
                         "ball.mp4", std::string("ball.mp4.txt") + io::temporary_mark + "4000000-1", "image",
                         std::string("other.mp4") + io::temporary_mark + "4000000-1"}));
}

// The next simulation then removes it if the program is killed.
TEST_F(Video, HasATemporaryNameUntilItIsWhole) {
  const fs::path program = scratch_ / "program";
  std::ofstream(program) << "#!/bin/sh\nfor word; do last=$word; done\necho \"$last\" > name\nexit 1\n";
  fs::permissions(program, fs::perms::owner_all);
  encode_video(run_, "ball", 24, program.string());
  std::string name;
  std::ifstream seen(run_.root / "name");
  std::getline(seen, name);
  EXPECT_TRUE(name.starts_with("./ball.mp4.tmp")) << name;
  EXPECT_TRUE(io::is_temporary(name)) << name;
}

// Pictures that are missing or empty in between are named. ffmpeg would end the video before the first of
// them without a message.
TEST_F(Video, MissingAndEmptyPicturesInBetweenAreNamed) {
  fs::remove(run_.image(4));
  std::ofstream(run_.image(5)).flush();
  try {
    encode_video(run_, "ball", 24);
    FAIL() << "a video that lacks frames";
  } catch (const FileError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("pictures are missing or empty, of frames 4 to 5"), std::string::npos) << text;
    EXPECT_NE(text.find("--frames 4:5"), std::string::npos) << text;
  }
  EXPECT_EQ(files(), std::vector<std::string>{"image"});
}

TEST_F(Video, IsGivenUpWhenAsked) {
  const std::atomic<bool> stop{true};
  EXPECT_NE(encode_video(run_, "ball", 24, "ffmpeg", &stop).find("interrupted"), std::string::npos);
  EXPECT_EQ(files(), std::vector<std::string>{"image"});
}

std::atomic<bool> asked{false};

// The signal that asks for the end interrupts the wait for the output of the encoder.
TEST_F(Video, IsGivenUpByASignalWhileItIsMade) {
  const fs::path encoder = run_.root / "encoder";
  std::ofstream(encoder)
      << "#!/bin/bash\nmkfifo silence\ntouch started\nread -r -t 20 <>silence\ntouch ended\n";
  fs::permissions(encoder, fs::perms::owner_all);
  struct sigaction action {};
  action.sa_handler = [](int) { asked = true; };
  ::sigaction(SIGUSR1, &action, nullptr);
  std::thread user([&, waiting = ::pthread_self()] {
    while (!fs::exists(run_.root / "started")) std::this_thread::yield();
    ::pthread_kill(waiting, SIGUSR1);
  });
  EXPECT_NE(encode_video(run_, "ball", 24, encoder.string(), &asked).find("interrupted"), std::string::npos);
  user.join();
  EXPECT_FALSE(fs::exists(run_.root / "ended"));
}

TEST_F(Video, NoPicturesIsANote) {
  fs::remove_all(run_.root / "image");
  EXPECT_NE(encode_video(run_, "ball", 24).find("holds no pictures"), std::string::npos);
}

}  // namespace
}  // namespace duet::render::video_test
