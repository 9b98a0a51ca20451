#include "tools/study/page.h"

#include <algorithm>
#include <cctype>

#include "tools/base64.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/printable.h"

namespace duet::study {
namespace {

constexpr const char* style = R"(
body { font: 15px/1.45 sans-serif; max-width: 1000px; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; font-size: 13px; margin: 0.8em 0; }
th, td { padding: 3px 9px; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #888; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.failed td { color: #b00; }
.scroll { overflow-x: auto; }
svg { max-width: 100%; height: auto; display: block; margin: 0.8em 0; }
.pictures { display: flex; flex-wrap: wrap; gap: 10px; }
figure { margin: 0; width: 300px; } figure img { width: 100%; display: block; } figcaption { font-size: 12px; }
@media print { body { max-width: none; margin: 0; } svg, figure, tr { break-inside: avoid; } h2 { break-after: avoid; } }
)";

// Returns whether a cell shows a number and is aligned to the right.
bool is_number(const std::string& text) {
  return text == "-" ||
         (!text.empty() && text.find_first_not_of("0123456789.+-e% x") == std::string::npos &&
          std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; }));
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

Page::Page(const std::string& title) : title_(title) {}

void Page::heading(const std::string& text) { body_ += fmt::format("<h2>{}</h2>\n", escaped(text)); }
void Page::text(const std::string& text) { body_ += fmt::format("<p>{}</p>\n", escaped(text)); }

void Page::table(const std::vector<std::vector<std::string>>& rows, const std::string& mark) {
  body_ += "<div class=\"scroll\"><table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool marked = r > 0 && std::find(rows[r].begin(), rows[r].end(), mark) != rows[r].end();
    body_ += marked ? "<tr class=\"failed\">" : "<tr>";
    for (std::size_t c = 0; c < rows[r].size(); ++c) {
      const std::string& cell = rows[r][c];
      const char* tag = r == 0 ? "th" : "td";
      body_ += fmt::format("<{}{}", tag, r > 0 && is_number(cell) ? " class=\"number\"" : "");
      // The last cell of a short row extends to the end of the row.
      if (c + 1 == rows[r].size() && c + 1 < rows[0].size())
        body_ += fmt::format(" colspan=\"{}\"", rows[0].size() - c);
      body_ += fmt::format(">{}</{}>", escaped(cell), tag);
    }
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
}

void Page::chart(const std::string& svg) { body_ += svg + "\n"; }

void Page::pictures(const std::vector<Picture>& pictures) {
  body_ += "<div class=\"pictures\">\n";
  for (const Picture& picture : pictures)
    body_ += fmt::format(
        "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
        escaped(picture.caption), tools::base64(io::read_file(picture.file)));
  body_ += "</div>\n";
}

// The empty icon keeps browsers from requesting one.
std::string Page::html() const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{0}</title>\n"
      "<link rel=\"icon\" "
      "href=\"data:,\">\n<style>{1}</style>\n</head>\n<body>\n<h1>{0}</h1>\n{2}</body>\n</html>\n",
      escaped(title_), style, body_);
}

}  // namespace duet::study
