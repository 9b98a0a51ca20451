#include "sim/io/vdb_file.h"

#include <sstream>
#include <utility>

#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>

#include "sim/base/error.h"

namespace duet::io {
namespace {

// Gives access to the writing of archives. `seekable` keeps the table of grid offsets that other programs
// read.
class MemoryArchive : public openvdb::io::Archive {
 public:
  std::string bytes(const openvdb::GridCPtrVec& grids) const {
    std::ostringstream out(std::ios::binary);
    Archive::write(out, grids, /*seekable=*/true);
    return std::move(out).str();
  }

 private:
  using Archive::write;
};

}  // namespace

std::string vdb_bytes(const openvdb::GridCPtrVec& grids) { return MemoryArchive().bytes(grids); }

std::vector<openvdb::FloatGrid::Ptr> read_vdb(const std::filesystem::path& path) {
  openvdb::initialize();
  std::vector<openvdb::FloatGrid::Ptr> grids;
  try {
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    const openvdb::GridPtrVecPtr all = file.getGrids();
    for (const openvdb::GridBase::Ptr& grid : *all)
      grids.push_back(openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
    file.close();
  } catch (const openvdb::Exception& error) {
    throw FileError(path.string(), error.what());
  }
  for (const openvdb::FloatGrid::Ptr& grid : grids)
    if (!grid) throw FileError(path.string(), "holds a grid whose values are no floats");
  return grids;
}

}  // namespace duet::io
