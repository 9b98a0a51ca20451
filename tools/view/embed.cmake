# Writes the files of FILES into the C++ file OUT as string data: page_file() of page.h finds them by their names.
set(entries)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  # Strings of 8,000 bytes, which the compiler joins: standard C++ promises no more than 65,536 in one.
  string(LENGTH "${text}" length)
  set(literal)
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${text}" ${at} 8000 piece)
    string(APPEND literal "\n     R\"PAGE(${piece})PAGE\"")
    math(EXPR at "${at} + 8000")
  endwhile()
  string(APPEND entries "    {\"${name}\",${literal}},\n")
endforeach()
file(WRITE ${OUT} "// Written by tools/view/embed.cmake.
#include \"tools/view/page.h\"

namespace duet::view {

const std::vector<PageFile>& page_files() {
  static const std::vector<PageFile> files = {
${entries}  };
  return files;
}

}  // namespace duet::view
")
