// A self-contained HTML page: headings, texts, tables, charts and pictures, with nothing to fetch.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace duet::study {

/// The text as it stands in HTML, between tags and in quoted attributes; control characters as \xNN.
std::string escaped(const std::string& text);

class Page {
 public:
  explicit Page(const std::string& title);

  void heading(const std::string& text);
  void text(const std::string& text);
  // The first row heads the columns; cells that are numbers stand to the right. A row that begins with `mark`
  // is set apart as failed.
  void table(const std::vector<std::vector<std::string>>& rows, const std::string& mark = "failed");
  void chart(const std::string& svg);
  // Side by side, each above its caption; PNG files, which become part of the page.
  struct Picture {
    std::filesystem::path file;
    std::string caption;
  };
  void pictures(const std::vector<Picture>& pictures);

  std::string html() const;

 private:
  std::string title_, body_;
};

}  // namespace duet::study
