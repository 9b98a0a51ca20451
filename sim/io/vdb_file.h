// OpenVDB files in memory, so that they are written and read like all other files: checked and atomically.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

namespace duet::io {

/// Half the width of the narrow band of level sets, voxels. 3 is the default of OpenVDB, which level-set
/// tools expect (LEVEL_SET_HALF_WIDTH). The size of a file is proportional to it.
inline constexpr int vdb_half_band = 3;

/// Returns the bytes of a file with the grids. OpenVDB's own file writer does not notice a full disk. Grids
/// that share a tree share its voxels in the file.
std::string vdb_bytes(const openvdb::GridCPtrVec& grids);

/// Reads all grids of a file. Throws FileError if it cannot be read, or holds a grid that is no FloatGrid.
std::vector<openvdb::FloatGrid::Ptr> read_vdb(const std::filesystem::path& path);

}  // namespace duet::io
