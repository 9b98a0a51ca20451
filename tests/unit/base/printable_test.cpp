#include "sim/base/printable.h"

#include <gtest/gtest.h>

namespace duet::printable_test {
namespace {

// Letters of all languages, signs and quotation marks stay; printable() keeps line breaks and tabs as well.
TEST(Printable, KeepsTextOfAllLanguages) {
  for (const char* text : {"", "a b", "Kugel auf Gummi: 30 \u00b0, \u00e4\u00f6\u00fc", "\u7403",
                           "\U0001f3b1", "\u00a0", "`$(x)` '\"\\"})
    EXPECT_EQ(printable_line(text), text);
  EXPECT_EQ(printable("two\nlines\tand a tab"), "two\nlines\tand a tab");
}

// Control characters, also those of Unicode that change colors or the direction of writing, are shown as
// bytes. A name in a scene could otherwise command the terminal.
TEST(Printable, ShowsControlCharactersAsBytes) {
  EXPECT_EQ(printable("\x1b[31mred\x07\x7f\r"), "\\x1b[31mred\\x07\\x7f\\x0d");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\u009b31m"), "\\xc2\\x9b31m") << "the C1 form of the same command";
  EXPECT_EQ(printable("a\u202eb\u2066"), "a\\xe2\\x80\\xaeb\\xe2\\x81\\xa6")
      << "turns the direction of writing";
  EXPECT_EQ(printable_line("two\nlines\t\u2028"), "two\\x0alines\\x09\\xe2\\x80\\xa8");
}

// Bytes that are not valid UTF-8 are shown as bytes: incomplete, overlong, surrogate and too large codes.
TEST(Printable, ShowsBytesThatAreNoUtf8) {
  for (const auto& [text, shown] : {std::pair{"\xff", "\\xff"},
                                    {"a\xc3", "a\\xc3"},
                                    {"\xc3(", "\\xc3("},
                                    {"\xc0\xaf", "\\xc0\\xaf"},           // overlong
                                    {"\xe0\x80\xaf", "\\xe0\\x80\\xaf"},  // overlong
                                    {"\xed\xa0\x80", "\\xed\\xa0\\x80"},  // a surrogate
                                    {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},
                                    {"\x9b"
                                     "31m",
                                     "\\x9b"
                                     "31m"}})
    EXPECT_EQ(printable(text), shown);
}

}  // namespace
}  // namespace duet::printable_test
