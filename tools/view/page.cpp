#include "tools/view/page.h"

#include <stdexcept>

#include "tools/report.h"
#include "tools/study/page.h"
#include <fmt/format.h>

#include "sim/base/files.h"

namespace duet::view {
namespace {

// The scripts in the order in which they stand in the page. They share one scope: each uses those before it.
constexpr const char* scripts[] = {"data.js",   "vectors.js",  "shaders.js", "geometry.js",
                                   "shadow.js", "renderer.js", "camera.js",  "charts.js",
                                   "panels.js", "input.js",    "main.js"};

std::string_view page_file(std::string_view name) {
  for (const PageFile& file : page_files())
    if (file.name == name) return file.text;
  throw std::logic_error(fmt::format("{} is not compiled into the program", name));
}

// The text of an element <script>: JSON in ASCII, in which no sequence ends the element or begins a comment.
std::string script_text(const nlohmann::ordered_json& object) {
  std::string text;
  for (const char c : tools::json_text(object)) text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

std::string replaced(std::string text, std::string_view mark, std::string_view by) {
  const std::size_t at = text.find(mark);
  if (at == std::string::npos) throw std::logic_error(fmt::format("page.html lacks {}", mark));
  return text.replace(at, mark.size(), by);
}

}  // namespace

bool is_page(const std::filesystem::path& path) {
  std::error_code missing;
  if (!std::filesystem::is_regular_file(path, missing)) return false;
  std::string start;
  io::read_pieces(path, [&](std::string_view piece) {
    start += piece;
    return start.size() < page_start.size();
  });
  return start.starts_with(page_start);
}

std::string page_head(const std::string& title, const nlohmann::ordered_json& run) {
  std::string body = replaced(std::string(page_file("page.html")), "{title}", study::escaped(title));
  body = replaced(std::move(body), "{style}", page_file("style.css"));
  return std::string(page_start) + body + "<script type=\"application/json\" id=\"run\">" + script_text(run) +
         "</script>\n";
}

std::string page_block(const std::string& block) {
  return "<script type=\"text/plain\" class=\"block\">" + block + "</script>\n";
}

std::string page_end() {
  std::string text = "<script>\n\"use strict\";\n(() => {\n";
  for (const char* name : scripts) text += page_file(name);
  return text + "})();\n</script>\n</body>\n</html>\n";
}

}  // namespace duet::view
