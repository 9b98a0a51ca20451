// DUET_ASSERT: checks of what a function relies on, for builds that look for faults.
#pragma once

/// DUET_ASSERT(condition) ends the program with the condition and its place where the condition does not
/// hold: in Debug and Sanitize builds, and in Release builds with -DDUET_ASSERTS=ON. Elsewhere it costs
/// nothing, and the condition is compiled but not evaluated. It is for faults of the program, such as an
/// index out of range; what a scene or a file can bring about is an Error instead.
#ifdef DUET_ASSERTS
#define DUET_ASSERT(condition) \
  (static_cast<bool>(condition) ? void() : ::duet::detail::end_at_assertion(#condition, __FILE__, __LINE__))
#else
#define DUET_ASSERT(condition) static_cast<void>(sizeof(static_cast<bool>(condition)))
#endif

namespace duet::detail {

/// Writes "FILE:LINE: CONDITION does not hold" to standard error and aborts.
[[noreturn]] void end_at_assertion(const char* condition, const char* file, int line);

}  // namespace duet::detail
