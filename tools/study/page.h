// Writes a self-contained HTML page of headings, texts, tables, charts and pictures, which fetches nothing.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace duet::study {

// Returns a text for use in HTML between tags and in quoted attributes. Control characters become \xNN.
std::string escaped(const std::string& text);

// A page under construction. Its functions append elements.
class Page {
 public:
  // Begins a page with a title.
  explicit Page(const std::string& title);

  // Appends a heading of the second level.
  void heading(const std::string& text);
  // Appends a paragraph.
  void text(const std::string& text);
  // Appends a table. The first row holds the heads of the columns; numbers are aligned to the right. A row
  // with a cell equal to `mark` is marked as failed.
  void table(const std::vector<std::vector<std::string>>& rows, const std::string& mark = "failed");
  // Appends an SVG element.
  void chart(const std::string& svg);
  // A PNG file, whose bytes become part of the page, and the caption below it.
  struct Picture {
    std::filesystem::path file;
    std::string caption;
  };
  // Appends pictures side by side. Throws FileError.
  void pictures(const std::vector<Picture>& pictures);

  // Returns the whole page.
  std::string html() const;

 private:
  std::string title_, body_;
};

}  // namespace duet::study
