#include "tools/interrupt.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <unistd.h>

#include "sim/base/error.h"

namespace duet::tools {
namespace {

// The answer to a first signal while a frame is computed.
struct Answer {
  std::array<char, 256> text{};  // what is printed
  std::size_t length = 0;        // number of characters of `text`
  bool finish = false;           // the frame is finished
};

std::atomic<bool> asked_to_stop{false}, asked_to_give_up{false};
std::atomic<int> orderly{0};  // number of OrderlyStop objects that live
// The answer of the FrameInHand that lives; null: none. Only the thread of FrameInHand writes `answer`, and
// only while the pointer is null; the handler of a first signal reads it.
std::atomic<const Answer*> in_hand{nullptr};
Answer answer;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free &&
                  std::atomic<const Answer*>::is_always_lock_free,
              "used by a signal handler");

// Writes to standard error, because a program may read standard output. Safe in a signal handler.
void say(std::string_view text) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

extern "C" void on_interrupt(int) {
  if (orderly == 0 || asked_to_stop.exchange(true)) {
    say("\nduet: interrupted: ended at once; files that were written are whole\n");
    ::_exit(static_cast<int>(ExitStatus::interrupted));
  }
  const Answer* frame = in_hand;
  if (frame == nullptr) {
    asked_to_give_up = true;
    return say(
        "\nduet: interrupted: what is in hand is given up, what is whole is kept; a second signal ends the "
        "program at once\n");
  }
  if (frame->finish)
    ::alarm(max_finishing_seconds);
  else
    asked_to_give_up = true;
  say({frame->text.data(), frame->length});
}

// The time for finishing the frame is over.
extern "C" void on_alarm(int) {
  if (!asked_to_stop || asked_to_give_up.exchange(true)) return;
  say("duet: interrupted: the frame takes longer than expected and is given up\n");
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;  // system calls in progress are restarted
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = on_alarm;
  ::sigaction(SIGALRM, &action, nullptr);
}

OrderlyStop::OrderlyStop() { ++orderly; }
OrderlyStop::~OrderlyStop() { --orderly; }

FrameInHand::FrameInHand(int frame, std::optional<double> expected) {
  answer.finish = expected && *expected <= max_finishing_seconds;
  std::string text;
  if (answer.finish)
    text = fmt::format(
        "frame {} is being finished, in about {:.2g} s (the frame before took as long) and {} s at most",
        frame, *expected, max_finishing_seconds);
  else if (expected)
    text = fmt::format("frame {} is given up, because the frame before took {:.0f} s", frame, *expected);
  else
    text = fmt::format(
        "frame {} is given up, as this program has finished no frame that tells how long it takes", frame);
  text = fmt::format("\nduet: interrupted: {}; a second signal ends the program at once\n", text);
  answer.length = std::min(text.size(), answer.text.size());
  std::copy_n(text.begin(), answer.length, answer.text.begin());
  in_hand = &answer;
}
FrameInHand::~FrameInHand() {
  in_hand = nullptr;
  if (asked_to_stop) ::alarm(0);
}

bool interrupted() { return asked_to_stop; }
const std::atomic<bool>& stop_flag() { return asked_to_stop; }
const std::atomic<bool>& give_up_flag() { return asked_to_give_up; }

}  // namespace duet::tools
