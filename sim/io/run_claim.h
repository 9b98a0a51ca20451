// Claims of run directories: which program writes to a run, on which machine, and whether it is still there.
// Claims need no locks of the file system, so that they hold on shared file systems (NFS), too.
#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace duet::io {

namespace fs = std::filesystem;

/// A process, named so that it is told from all others, also from later ones with the same number.
struct ProcessName {
  std::string host;  ///< name of its machine
  std::string
      machine;       ///< identifies the boot of its machine and its process namespace: process ids count here
  long process = 0;  ///< process id
  long long start = 0;  ///< time at which it started, in clock ticks since the machine's boot

  /// Returns true if all fields are equal.
  bool operator==(const ProcessName&) const = default;
};

/// Returns the name of this process.
ProcessName this_process();

/// What is known of a process.
enum class Life {
  alive,   ///< it runs on this machine
  ended,   ///< it ran on this machine and has ended
  unknown  ///< it runs or ran on another machine
};

/// Returns whether the process lives, as far as this machine can tell.
Life life_of(const ProcessName& process);

/// Returns the process as a JSON object, and reads one. Reading returns none for any other text.
std::string process_json(const ProcessName& process);
/// Reads what process_json() returns.
std::optional<ProcessName> read_process(const std::string& json);

/// Times by which a claim of another machine is judged, s.
struct ClaimTimes {
  double beat =
      5;  ///< between two signs of life of a holder: a shorter time costs the file server more requests
  double silence =
      60;  ///< without a sign of life, after which a holder counts as gone; 12 beats, in which NFS recovers
};

/// The holder of a claim, as another program reads it.
struct ClaimHolder {
  ProcessName process;  ///< holder
  std::string work;     ///< what it does: "duet sim"
  std::string since;    ///< when it took the claim, UTC: "2026-11-28 19:45:10"
  /// Returns a phrase that names the holder: "duet sim, process 4711 on node3, since 2026-11-28 19:45:10
  /// UTC".
  std::string text() const;
};

/// The claim of a run directory: a file claim/NNNN.json in it that names the holder, who touches it every few
/// seconds. At most one program holds the claim. A claim whose holder has ended is replaced: at once if the
/// holder ran on this machine; after ClaimTimes::silence without a sign of life if it ran on another one. A
/// claim is taken by a hard link to the next free number, which one of several programs gets on every file
/// system. Where there are no hard links, an exclusive creation takes their place.
class RunClaim {
 public:
  /// Takes the claim of the existing folder `root` for some `work`. Waits up to `wait` (s) while another
  /// program holds it. Throws FileError that names the holder if it still does then, or if the claim cannot
  /// be written. Examining a silent holder on another machine takes ClaimTimes::silence, whatever `wait` is.
  RunClaim(const fs::path& root, const std::string& work, double wait = 0, const ClaimTimes& times = {});
  /// Releases the claim.
  ~RunClaim();
  RunClaim(const RunClaim&) = delete;
  RunClaim& operator=(const RunClaim&) = delete;

  /// Throws FileError if another program has taken the claim over, because this one gave no sign of life for
  /// so long: nothing may be written any more. To be called before every group of writes.
  void require_held() const;

  /// Returns the holder of the claim of the folder `root` that is alive, or on another machine; none if there
  /// is no claim, or if its holder ended on this machine.
  static std::optional<ClaimHolder> holder(const fs::path& root);

 private:
  // Tries to take the claim. Returns the holder if another program holds it, else none.
  std::optional<ClaimHolder> try_to_take(const std::string& work);
  // Touches the claim every few seconds until `ended_` is set.
  void beat();

  const fs::path folder_;
  const ClaimTimes times_;
  fs::path file_;  // claim; empty: none is held
  std::mutex mutex_;
  std::condition_variable ending_;
  bool ended_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace duet::io
